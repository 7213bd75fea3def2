#![expect(clippy::float_cmp, reason = "these values are exact")]

use crate::effect::bench::{free, signals_mm, simulator, upon};
use crate::{Effect, Moment, Pipeline, Simulator, Trajectory};

fn relaxing(time_constant_s: f64, spread_ratio: f64) -> Effect {
    let shape = [("time_constant_s", time_constant_s), ("spread_ratio", spread_ratio)];
    Effect::new(
        "relaxation",
        [("relaxed_share", 0.3), ("after_release", 0.0), ("recovery_ratio", 1.0)].into_iter().chain(shape),
    )
    .unwrap()
}

fn creeping() -> Simulator {
    let mut one = simulator([relaxing(4.0, 1.0)]);
    let mut response = one.model.response().clone();
    response.quadratic_per_mm = vec![0.0; 48];
    response.baseline_counts = vec![0.0; 48];
    one.model = crate::ForwardModel::new(one.model.array().clone(), one.model.psf(), response).unwrap();
    one
}

#[test]
fn a_step_that_is_held_falls_exponentially_and_comes_back() {
    let one = creeping();
    let (up, down) = (upon(&one, 21, -1.0), upon(&one, 21, 0.5));
    let mut pipeline = Pipeline::new(&one).unwrap();
    let at_once = pipeline.step(Moment::at(0.0), &down)[21];
    for t_s in [0.1, 0.2, 1.0, 7.0, 100.0] {
        let want = at_once * (1.0 - 0.3 * (1.0 - (-t_s / 4.0_f64).exp()));
        assert!((pipeline.step(Moment::at(t_s), &down)[21] - want).abs() < 1e-9, "after {t_s} s");
    }
    // Released, it reads nothing; pressed again before it has recovered, it answers more weakly.
    assert_eq!(pipeline.step(Moment::at(100.0), &up)[21], 0.0);
    assert_eq!(pipeline.step(Moment::at(102.0), &up)[21], 0.0);
    let again = pipeline.step(Moment::at(102.0), &down)[21];
    assert!((again - at_once * (1.0 - 0.3 * (-0.5_f64).exp())).abs() < 1e-7, "{again}");
    pipeline.reset();
    assert!((pipeline.step(Moment::at(0.0), &down)[21] - at_once).abs() < 1e-12, "the past is forgotten");
}

#[test]
fn a_linear_solid_shows_what_it_has_forgotten_after_release() {
    let mut one = creeping();
    one.effects = vec![relaxing(4.0, 1.0).with("after_release", 1.0).unwrap()];
    let (up, down) = (upon(&one, 21, -0.5), upon(&one, 21, 0.5));
    let mut pipeline = Pipeline::new(&one).unwrap();
    let at_once = pipeline.step(Moment::at(0.0), &down)[21];
    pipeline.step(Moment::at(400.0), &down);
    // Let go at once after a long hold: all that had relaxed is missing, and comes back with the time constant.
    let released = pipeline.step(Moment::at(400.0), &up)[21];
    assert!((released + 0.3 * at_once).abs() < 1e-9, "{released}");
    let later = pipeline.step(Moment::at(404.0), &up)[21];
    assert!((later + 0.3 * at_once * (-1.0_f64).exp()).abs() < 1e-9, "{later}");
}

#[test]
fn a_deeper_press_loses_a_larger_share_if_it_goes_by_depth() {
    let mut one = creeping();
    one.effects = vec![relaxing(4.0, 1.0).with("by_depth", 1.0).unwrap()];
    for depth_mm in [0.2, 0.5, 0.8] {
        let down = upon(&one, 21, depth_mm);
        let mut pipeline = Pipeline::new(&one).unwrap();
        let at_once = pipeline.step(Moment::at(0.0), &down)[21];
        let share = 0.3 * depth_mm / 1.016 * (1.0 - (-0.5_f64).exp());
        let later = pipeline.step(Moment::at(2.0), &down)[21];
        assert!((later - at_once * (1.0 - share)).abs() < 1e-9, "{depth_mm} mm: {later}");
    }
}

#[test]
fn a_press_reads_the_same_at_any_rate() {
    // The reference tool's signal is in proportion to depth, and so straight between the points.
    let one = creeping();
    let press = Trajectory::new([
        (0.0, upon(&one, 21, 0.0)),
        (0.5, upon(&one, 21, 0.5)),
        (3.0, upon(&one, 21, 0.5)),
        (4.0, upon(&one, 21, 0.1)),
    ])
    .unwrap();
    let last = |rate_hz: f64, frames| {
        one.run(&press, rate_hz, frames, || 0.0).unwrap().last().unwrap().clean_counts[21]
    };
    let slow = last(2.0, 9);
    for (rate_hz, frames) in [(10.0, 41), (30.0, 121), (1000.0, 4001)] {
        let fast = last(rate_hz, frames);
        assert!((fast - slow).abs() < 1e-9, "{rate_hz} Hz: {fast} {slow}");
    }
}

#[test]
fn three_times_relax_in_equal_shares() {
    let at = |t_s: f64| {
        0.5 * (1.0 - 0.1 * [0.5, 2.0, 8.0].map(|tau_s: f64| -(-t_s / tau_s).exp_m1()).iter().sum::<f64>())
    };
    let times_s = [0.0, 0.3, 2.0, 20.0];
    let signals = signals_mm(&relaxing(2.0, 4.0), times_s.map(|t_s| (t_s, 0.5)));
    assert!(signals.iter().zip(times_s).all(|(got, t_s)| (got - at(t_s)).abs() < 1e-9), "{signals:?}");
}

#[test]
fn knots_are_a_prony_series() {
    let [taus_s, weights] = [[0.1, 1.0, 8.0, 40.0], [0.05, 0.2, 0.0, 0.1]];
    let series = free("relaxation", [("after_release", 0.0), ("recovery_ratio", 1.0)], &taus_s, &weights);
    let relaxed =
        |t_s: f64| taus_s.iter().zip(weights).map(|(tau_s, w)| w * -(-t_s / tau_s).exp_m1()).sum::<f64>();
    let times_s = [0.0, 0.05, 0.7, 6.0, 50.0];
    let signals = signals_mm(&series, times_s.map(|t_s| (t_s, 0.5)));
    for (got, t_s) in signals.iter().zip(times_s) {
        assert!((got - 0.5 * (1.0 - relaxed(t_s))).abs() < 1e-9, "after {t_s} s: {got}");
    }
}

#[test]
fn the_formula_is_three_of_many_times() {
    let one = relaxing(2.0, 4.0);
    let curve = one.definition().curve.as_ref().unwrap();
    let at_s = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
    let weights = (curve.formula)(one.values(), &at_s);
    let kept = [("after_release", 0.0), ("recovery_ratio", 1.0)];
    let depths = [(0.0, 0.5), (0.3, 0.5), (2.0, 0.2), (30.0, 0.4)];
    let [three, many] = [one, free("relaxation", kept, &at_s, &weights)].map(|one| signals_mm(&one, depths));
    assert!(three.iter().zip(many).all(|(a, b)| (a - b).abs() < 1e-12), "{three:?} {many:?}");
    // Between two times a part belongs to both, by their logarithms.
    let weights = (curve.formula)(relaxing(2.0_f64.sqrt(), 1.0).values(), &at_s);
    let near = |got: f64, want: f64| (got - want).abs() < 1e-12;
    assert!(
        near(weights[2], 0.15) && near(weights[3], 0.15) && near(weights.iter().sum(), 0.3),
        "{weights:?}"
    );
}
