use super::student_95;

#[test]
fn students_quantile_is_that_of_the_table() {
    // Abramowitz and Stegun, table 26.10.
    for (freedom, want) in [(3, 2.353), (5, 2.015), (10, 1.812), (30, 1.697)] {
        assert!((student_95(freedom + 1) - want).abs() < 0.01, "{freedom}: {}", student_95(freedom + 1));
    }
}
