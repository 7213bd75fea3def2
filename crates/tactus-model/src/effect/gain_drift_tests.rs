use crate::effect::bench::{assert_slopes, effect, simulator, still, upon};
use crate::{Effect, Moment, Pipeline};

fn drift(rate_per_h: f64, rate_per_k: f64) -> Effect {
    effect("gain-drift", [("rate_per_h", rate_per_h), ("rate_per_k", rate_per_k)])
}

#[test]
fn what_stands_above_the_baseline_grows_with_time_and_temperature() {
    let one = simulator([drift(0.06, -0.01)]);
    let tip_mm = upon(&one, 21, 0.4);
    let plain = still(&simulator([]), tip_mm);
    let mut pipeline = Pipeline::new(&one).unwrap();
    for (t_s, temperature_c, gain) in [
        (0.0, None, 1.0),
        (600.0, None, 1.01),
        (600.0, Some(21.0), 1.01),
        (1800.0, Some(24.0), 1.0),
        (3600.0, Some(19.0), 1.08),
        (3600.0, None, 1.06),
    ] {
        for (got, plain) in pipeline.step(Moment { t_s, temperature_c }, &tip_mm).iter().zip(&plain) {
            let want = 100.0 + (plain - 100.0) * gain;
            assert!((got - want).abs() < 1e-9, "after {t_s} s at {temperature_c:?}: {got} {want}");
        }
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    assert_slopes(&drift(0.5, 0.01), &["rate_per_h", "rate_per_k"]);
}
