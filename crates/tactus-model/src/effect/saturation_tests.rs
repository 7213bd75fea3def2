use crate::Effect;
use crate::effect::bench::{assert_slopes, effect, felt_mm};

fn level(inverse_square_ceiling_per_mm2: f64) -> Effect {
    effect("saturation", [("inverse_square_ceiling_per_mm2", inverse_square_ceiling_per_mm2)])
}

#[test]
fn signals_level_off_at_the_ceiling() {
    let got = felt_mm(&level(4.0), [(0.0, 0.001), (0.0, 0.25), (0.0, 0.5), (0.0, 1.0)]);
    // tanh of 1/2, 1 and 2, Abramowitz and Stegun, table 4.15.
    let want = [0.001, 0.5 * 0.462_117_157, 0.5 * 0.761_594_156, 0.5 * 0.964_027_580];
    for (got, want) in got.iter().zip(want) {
        assert!((got - want).abs() < 2e-9, "{got} {want}");
    }
    let [deep] = felt_mm(&level(100.0), [(0.0, 1.0)]);
    assert!(deep < 0.1 && deep > 0.1 * (1.0 - 1e-8), "{deep}");
}

#[test]
fn the_derivative_is_that_of_differences() {
    assert_slopes(&level(1.5), &["inverse_square_ceiling_per_mm2"]);
    // Where its closed form has no digits left.
    assert_slopes(&level(0.005), &["inverse_square_ceiling_per_mm2"]);
}
