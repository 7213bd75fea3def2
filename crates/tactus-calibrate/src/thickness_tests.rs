use super::*;

#[test]
fn tails_of_chi_squared_are_those_of_tables() {
    // Upper 5 % points, Abramowitz and Stegun, Table 26.8.
    for (freedom, value) in [
        (1, 3.841_46),
        (2, 5.991_47),
        (3, 7.814_73),
        (4, 9.487_73),
        (5, 11.0705),
        (10, 18.3070),
        (11, 19.6751),
    ] {
        assert!((chi_squared_beyond(freedom, value) - 0.05).abs() < 1e-6, "{freedom}");
    }
    assert!((chi_squared_beyond(9, 0.0) - 1.0).abs() < 1e-12);
}
