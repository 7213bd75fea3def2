use super::*;

#[test]
fn a_path_is_read_line_by_line() {
    let trajectory = parse("t_s,x_mm,y_mm,z_mm\n0,1,2,0.5\n\n2, 3, 2, -0.5\n").unwrap();
    let want = Trajectory::new([(0.0, [1.0, 2.0, 0.5]), (2.0, [3.0, 2.0, -0.5])]).unwrap();
    assert_eq!(trajectory, want);
}

#[test]
fn what_is_no_path_is_refused_by_line() {
    let refused = |text: &str| format!("{:#}", parse(text).unwrap_err());
    assert_eq!(refused("0,1,2,3"), "the first line must be t_s,x_mm,y_mm,z_mm");
    let header = "t_s,x_mm,y_mm,z_mm\n";
    assert!(refused(&format!("{header}0,1,2,deep")).starts_with("line 2: \"deep\" is not a number"));
    assert_eq!(refused(&format!("{header}0,1,2,3\n1,2,3")), "line 3: 3 numbers instead of 4");
    assert!(refused(header).contains("at least one point"));
    assert!(refused(&format!("{header}1,0,0,0\n1,0,0,0")).contains("times must rise"));
}
