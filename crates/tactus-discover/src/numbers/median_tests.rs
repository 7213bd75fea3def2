use super::median;

#[test]
fn half_of_the_values_are_on_each_side() {
    for (values, want) in [
        (&[][..], 0.0),
        (&[3.0], 3.0),
        (&[3.0, -1.0], 1.0),
        (&[9.0, -1.0, 4.0], 4.0),
        (&[7.0, 1.0, 5.0, 2.0], 3.5),
        (&[2.0, 2.0, 8.0, 2.0, 8.0, 8.0], 5.0),
        (&[6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0], 3.0),
    ] {
        assert!((median(values) - want).abs() < 1e-15, "{values:?}: {}", median(values));
    }
}
