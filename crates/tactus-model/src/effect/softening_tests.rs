use crate::Effect;
use crate::effect::bench::{THIN, effect, free, signals_mm};

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

#[test]
fn damage_follows_the_greatest_signal_or_all_loading_so_far() {
    let softening = |past_share| free("softening", [("past_share", past_share)], &[0.5], &[0.5]);
    // Of a covering of this thickness q / (q + thickness) is 0.2 after a loading to a quarter of it.
    let thick_mm = THIN.thickness_mm;
    let depths = [1.0, 0.5, 0.0, 1.0].map(|share| (0.0, 0.25 * thick_mm * share));
    let lost = |q: f64| q / (q + thick_mm);
    let [whole, half] = [0.25 * thick_mm, 0.125 * thick_mm];
    let damage = [whole * (1.0 - lost(whole)), half * (1.0 - lost(whole)), 0.0, whole * (1.0 - lost(whole))];
    let work = [damage[0], damage[1], 0.0, whole * (1.0 - lost(2.0 * whole))];
    for (past_share, want) in [(1.0, damage), (-1.0, work)] {
        for (got, want) in signals_mm(&softening(past_share), depths).iter().zip(want) {
            assert!((got - want).abs() < 1e-9, "{past_share}: {got} {want}");
        }
    }
}
