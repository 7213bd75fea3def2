#![expect(clippy::float_cmp, reason = "these values are exact")]

use crate::effect::bench::{effect, simulator, still, upon};

#[test]
fn a_surface_that_stands_higher_is_pressed_deeper() {
    let higher = simulator([effect("surface-offset", [("offset_mm", 0.125)])]);
    let (at, deeper) = (upon(&higher, 21, 0.25), upon(&higher, 21, 0.375));
    assert_eq!(still(&higher, at), still(&simulator([]), deeper));
    let lower = simulator([effect("surface-offset", [("offset_mm", -0.25)])]);
    assert!(still(&lower, at).iter().all(|counts| *counts == 100.0), "a threshold of contact");
}
