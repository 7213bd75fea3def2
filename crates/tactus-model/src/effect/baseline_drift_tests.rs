use crate::effect::bench::{assert_slopes, effect, simulator, still, upon};
use crate::{Effect, Moment, Pipeline};

fn drift(rate: f64, warm_up: f64, time_constant_s: f64) -> Effect {
    effect(
        "baseline-drift",
        [("rate_counts_per_s", rate), ("warm_up_counts", warm_up), ("time_constant_s", time_constant_s)],
    )
}

#[test]
fn the_zero_goes_on_and_settles_alike_on_all_elements() {
    let one = simulator([drift(-0.01, 20.0, 300.0)]);
    let tip_mm = upon(&one, 21, 0.4);
    let plain = still(&simulator([]), tip_mm);
    let mut pipeline = Pipeline::new(&one).unwrap();
    // 1 - 1/e is 0.632 120 558 8.
    for (t_s, want) in [(0.0, 0.0), (300.0, -3.0 + 20.0 * 0.632_120_558_8), (1e5, -1000.0 + 20.0)] {
        for (got, plain) in pipeline.step(Moment::at(t_s), &tip_mm).iter().zip(&plain) {
            assert!((got - plain - want).abs() < 1e-8, "after {t_s} s: {}", got - plain);
        }
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    assert_slopes(&drift(0.1, 30.0, 40.0), &["rate_counts_per_s", "warm_up_counts", "time_constant_s"]);
}
