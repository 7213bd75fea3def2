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

#[test]
fn it_is_the_sum_of_its_derivatives_by_the_knots() {
    for t_s in [0.0, 3.0, 10.0, 29.0, 38.0, 40.0, 99.0] {
        let sum: f64 = CURVE.iter().enumerate().map(|(index, knot)| knot * curve().by_knot(index, t_s)).sum();
        assert!((curve().at(t_s) - sum).abs() < 1e-12, "at {t_s} s");
    }
}

#[test]
fn the_derivative_by_the_duration_is_that_of_differences() {
    for t_s in [3.0, 13.0, 29.0, 38.0, 99.0] {
        let at = |duration_s| Curve::<4>::new(duration_s, &CURVE).at(t_s);
        let want = (at(40.0 + 1e-3) - at(40.0 - 1e-3)) / 2e-3;
        assert!((curve().by_duration(t_s) - want).abs() < 1e-7, "at {t_s} s: {want}");
    }
}
