use super::*;

/// Knots every 10 s.
const CURVE: [f64; 4] = [3.0, -1.0, -1.0, 2.0];

fn curve() -> Curve<4> {
    Curve::new(40.0, &CURVE)
}

#[test]
fn it_runs_straight_from_0_through_its_knots_and_stays_at_the_last() {
    let points = [(0.0, 0.0), (5.0, 1.5), (10.0, 3.0), (12.5, 2.0), (25.0, -1.0), (40.0, 2.0), (1e6, 2.0)];
    for (t_s, want) in points.into_iter().chain([(-3.0, 0.0)]) {
        assert!((curve().at(t_s) - want).abs() < 1e-12, "at {t_s} s: {}", curve().at(t_s));
    }
    assert!(curve().at(f64::NAN).is_nan());
}
