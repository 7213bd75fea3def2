use crate::effect::bench::{THIN, assert_slopes, effect, simulator, still, upon};

/// Equivalent indentation of an element whose response is `s (u + 0.15 u^2)`.
fn signal_mm(counts: f64, element: usize) -> f64 {
    let rise = (counts - 100.0) / (900.0 + 5.0 * element as f64);
    ((1.0 + 4.0 * 0.15 * rise).sqrt() - 1.0) / 0.3
}

#[test]
fn the_reference_press_reads_depth_and_its_cube() {
    let hard = simulator([effect("hardening", [("cubic_per_mm2", 0.8)])]);
    for depth_mm in [0.2, 0.6, 1.5] {
        let counts = still(&hard, upon(&hard, 21, depth_mm));
        let reached_mm = THIN.thickness_mm.min(depth_mm);
        let want_mm = reached_mm + 0.8 * reached_mm.powi(3);
        assert!((signal_mm(counts[21], 21) - want_mm).abs() < 1e-9, "at {depth_mm} mm");
    }
}

#[test]
fn all_elements_gain_alike() {
    let (soft, hard) = (simulator([]), simulator([effect("hardening", [("cubic_per_mm2", 0.8)])]));
    let tip_mm = upon(&soft, 21, 0.5);
    for (element, (hard, soft)) in still(&hard, tip_mm).iter().zip(still(&soft, tip_mm)).enumerate() {
        let ratio = signal_mm(*hard, element) / signal_mm(soft, element);
        assert!((ratio - 1.2).abs() < 1e-6, "element {element}: {ratio}");
    }
}

#[test]
fn the_derivative_is_that_of_differences() {
    assert_slopes(&effect("hardening", [("cubic_per_mm2", 0.5)]), &["cubic_per_mm2"]);
}
