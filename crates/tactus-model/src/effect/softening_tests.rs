use crate::Effect;
use crate::effect::bench::{effect, free, signals_mm};

fn soft(width_share: f64) -> Effect {
    effect("softening", [("softened_share", 0.2), ("width_share", width_share)])
}

#[test]
fn a_first_loading_is_the_base_models_and_later_ones_are_weaker_up_to_where_it_went() {
    let depths = [0.2, 0.4, 0.2, 0.0, 0.2, 0.4, 0.5].map(|depth_mm| (0.0, depth_mm));
    // erf(3/4), Abramowitz and Stegun, table 7.1.
    let weaker = 0.2 * (1.0 - 0.2 * 0.711_155_633_7);
    let want = [0.2, 0.4, weaker, 0.0, weaker, 0.4, 0.5];
    for (got, want) in signals_mm(&soft(1.0), depths).iter().zip(want) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}

#[test]
fn a_narrow_width_weakens_all_below_alike() {
    let [.., got] = signals_mm(&soft(0.01), [(0.0, 0.5), (1.0, 0.4)]);
    assert!((got - 0.8 * 0.4).abs() < 1e-9, "{got}");
}

#[test]
fn knots_give_a_loss_below_the_greatest_of_any_shape() {
    // Nothing is lost in the first fifth below the greatest signal.
    let late = free("softening", [], &[0.2, 0.6], &[0.0, 0.4]);
    let depths = [0.25, 0.5, 0.45, 0.3, 0.2, 0.1, 0.6].map(|depth_mm| (0.0, depth_mm));
    let want = [0.25, 0.5, 0.45, 0.3 * 0.8, 0.2 * 0.6, 0.1 * 0.6, 0.6];
    for (got, want) in signals_mm(&late, depths).iter().zip(want) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}
