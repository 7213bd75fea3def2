use crate::Effect;
use crate::effect::bench::{THIN, effect, free, signals_mm, simulator, still, upon};

fn hard(growth_at_1_mm: f64, exponent: f64) -> Effect {
    effect("hardening", [("growth_at_1_mm", growth_at_1_mm), ("exponent", exponent), ("own_share", 0.0)])
}

/// Equivalent indentation of an element whose response is `s (u + 0.15 u^2)`.
fn signal_mm(counts: f64, element: usize) -> f64 {
    let rise = (counts - 100.0) / (900.0 + 5.0 * element as f64);
    ((1.0 + 4.0 * 0.15 * rise).sqrt() - 1.0) / 0.3
}

#[test]
fn an_exponent_of_two_adds_the_cube_of_depth() {
    let one = simulator([hard(0.8, 2.0)]);
    for depth_mm in [0.2, 0.6, 1.5] {
        let counts = still(&one, upon(&one, 21, depth_mm));
        let reached_mm = THIN.thickness_mm.min(depth_mm);
        let want_mm = reached_mm + 0.8 * reached_mm.powi(3);
        assert!((signal_mm(counts[21], 21) - want_mm).abs() < 1e-9, "at {depth_mm} mm");
    }
}

#[test]
fn all_elements_gain_alike() {
    let (soft, hard) = (simulator([]), simulator([hard(0.8, 2.0)]));
    let tip_mm = upon(&soft, 21, 0.5);
    for (element, (hard, soft)) in still(&hard, tip_mm).iter().zip(still(&soft, tip_mm)).enumerate() {
        let ratio = signal_mm(*hard, element) / signal_mm(soft, element);
        assert!((ratio - 1.2).abs() < 1e-6, "element {element}: {ratio}");
    }
}

#[test]
fn an_element_may_gain_by_its_own_signal() {
    let own = hard(0.8, 1.0).with("own_share", 1.0).unwrap();
    let (soft, hard) = (simulator([]), simulator([own]));
    let tip_mm = upon(&soft, 21, 0.5);
    for (element, (hard, soft)) in still(&hard, tip_mm).iter().zip(still(&soft, tip_mm)).enumerate() {
        let u = signal_mm(soft, element);
        assert!((signal_mm(*hard, element) - u * (1.0 + 0.8 * u)).abs() < 1e-9, "element {element}");
    }
}

#[test]
fn knots_give_a_growth_of_any_shape() {
    // A stiffer layer bears from 0.2 mm on, which no power of depth is.
    let layered =
        |own_share| free("hardening", [("own_share", own_share)], &[0.2, 0.4, 0.6], &[0.0, 0.3, 0.4]);
    let depths_mm = [0.1, 0.2, 0.3, 0.4, 0.55, 0.6, 0.9];
    let growth = [0.0, 0.0, 0.15, 0.3, 0.375, 0.4, 0.4];
    for own_share in [0.0, 1.0] {
        // Over its centre an element's own signal is the depth.
        let signals = signals_mm(&layered(own_share), depths_mm.map(|depth_mm| (0.0, depth_mm)));
        for ((signal, depth_mm), growth) in signals.iter().zip(depths_mm).zip(growth) {
            assert!((signal - depth_mm * (1.0 + growth)).abs() < 1e-9, "at {depth_mm} mm: {signal}");
        }
    }
}
