use super::DEFINITION;
use crate::effect::bench::{free, simulator, still, upon};
use crate::{Effect, Moment, Pipeline};

/// A gain that grows by 6 % in the first 10 of 60 minutes, and by as much in the last.
fn drift(rate_per_k: f64) -> Effect {
    let values = [
        ("rate_per_k", rate_per_k),
        ("duration_s", 3600.0),
        ("gain_01_share", 0.06),
        ("gain_06_share", 0.06),
    ];
    values
        .into_iter()
        .fold(Effect::neutral(&DEFINITION), |effect, (name, value)| effect.with(name, value).unwrap())
}

#[test]
fn what_stands_above_the_baseline_grows_with_time_and_temperature() {
    let one = simulator([drift(-0.01)]);
    let tip_mm = upon(&one, 21, 0.4);
    let plain = still(&simulator([]), tip_mm);
    let mut pipeline = Pipeline::new(&one).unwrap();
    for (t_s, temperature_c, gain) in [
        (0.0, None, 1.0),
        (100.0, None, 1.01),
        (100.0, Some(21.0), 1.01),
        (600.0, Some(24.0), 1.03),
        (3300.0, Some(19.0), 1.05),
        (7200.0, None, 1.06),
    ] {
        for (got, plain) in pipeline.step(Moment { t_s, temperature_c }, &tip_mm).iter().zip(&plain) {
            let want = 100.0 + (plain - 100.0) * gain;
            assert!((got - want).abs() < 1e-9, "after {t_s} s at {temperature_c:?}: {got} {want}");
        }
    }
}

#[test]
fn knots_give_a_gain_of_any_shape() {
    // Up by a tenth in 100 s, then a jump down within 1 s.
    let jumps = free("gain-drift", [("rate_per_k", 0.0)], &[100.0, 101.0], &[0.1, -0.2]);
    let one = simulator([jumps]);
    let tip_mm = upon(&one, 21, 0.4);
    let plain = still(&simulator([]), tip_mm);
    let mut pipeline = Pipeline::new(&one).unwrap();
    for (t_s, gain) in [(0.0, 1.0), (50.0, 1.05), (100.5, 0.95), (101.0, 0.8), (900.0, 0.8)] {
        for (got, plain) in pipeline.step(Moment::at(t_s), &tip_mm).iter().zip(&plain) {
            let want = 100.0 + (plain - 100.0) * gain;
            assert!((got - want).abs() < 1e-9, "after {t_s} s: {got} {want}");
        }
    }
}
