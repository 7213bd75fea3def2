use super::*;

#[test]
fn a_line_names_curves_and_tables_beside_the_parameters() {
    let curve = |at, of| FittedCurve { at, of, knots: Vec::new(), formula: None };
    let table = curve("x_mm", "offset_y_mm");
    assert_eq!(with_curves(String::new(), &[table]), "offset_y_mm as a table of x_mm");
    let knots = curve("at_mm", "growth");
    assert_eq!(with_curves("own_share 0.2".into(), &[knots]), "own_share 0.2, growth through knots");
    assert_eq!(with_curves("ratio 1.1".into(), &[]), "ratio 1.1");
}

#[test]
fn a_number_without_an_error_is_short() {
    let cases = [
        (22.0, "22"),
        (0.999_999_998_268, "1.0000"),
        (0.012_345_6, "0.01235"),
        (1234.56, "1235"),
        (-0.5, "-0.5000"),
    ];
    for (value, words) in cases {
        assert_eq!(four_digits(value), words);
    }
}
