use super::*;

#[test]
fn p_values_are_those_of_tables() {
    // Two-sided 5 % points of Student's t.
    for (freedom, t) in
        [(1, 12.706), (2, 4.303), (3, 3.182), (4, 2.776), (5, 2.571), (10, 2.228), (30, 2.042), (31, 2.040)]
    {
        assert!((p_of_t(t, freedom) - 0.05).abs() < 1e-4, "{freedom}: {}", p_of_t(t, freedom));
        assert!((p_of_t(-t, freedom) - 0.05).abs() < 1e-4);
    }
    assert!((p_of_t(0.0, 7) - 1.0).abs() < 1e-12);
}

#[test]
fn a_line_needs_three_runs_at_different_times() {
    assert_eq!(slope(&[[0.0, 1.0, 0.1], [1.0, 2.0, 0.1]]), None);
    assert_eq!(slope(&[[1.0, 1.0, 0.1], [1.0, 2.0, 0.1], [1.0, 3.0, 0.1]]), None);
    let line = slope(&[[0.0, 1.0, 0.1], [1.0, 3.1, 0.1], [2.0, 4.9, 0.1], [3.0, 7.0, 0.1]]).unwrap();
    assert!((line.per_day - 1.98).abs() < 1e-9 && line.p_value < 0.01, "{line:?}");
    let level = slope(&[[0.0, 5.0, 0.1], [1.0, 5.0, 0.1], [2.0, 5.0, 0.1]]).unwrap();
    assert!(level.p_value > 0.99, "{level:?}");
    // A change on a line without scatter that is far below the values' own errors.
    let slight = slope(&[[0.0, 5.0, 0.1], [1.0, 5.001, 0.1], [2.0, 5.002, 0.1]]).unwrap();
    assert!(slight.p_value > 0.9, "{slight:?}");
}
