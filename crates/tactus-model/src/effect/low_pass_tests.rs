#![expect(clippy::float_cmp, reason = "these values are exact")]

use crate::effect::Definition;
use crate::effect::bench::{effect, free, simulator, still, upon};
use crate::{Moment, Pipeline};

#[test]
fn a_jump_is_followed_exponentially_from_a_settled_start() {
    let slow = simulator([effect("low-pass", [("time_constant_s", 0.2)])]);
    let (up, down) = (upon(&slow, 21, -1.0), upon(&slow, 21, 0.5));
    let full = still(&slow, down)[21];
    let mut pipeline = Pipeline::new(&slow).unwrap();
    assert_eq!(pipeline.step(Moment::at(0.0), &up)[21], 100.0);
    pipeline.step(Moment::at(0.0), &down);
    for t_s in [0.01, 0.1, 0.5] {
        let want = full + (100.0 - full) * (-t_s / 0.2_f64).exp();
        assert!((pipeline.step(Moment::at(t_s), &down)[21] - want).abs() < 1e-9, "after {t_s} s");
    }
}

/// The counts of element 21 after a press that begins and ends at once, moment by moment.
fn after_a_jump(slow: &crate::Simulator, moments_s: &[f64]) -> (f64, Vec<f64>) {
    let (up, down) = (upon(slow, 21, -1.0), upon(slow, 21, 0.5));
    let mut settled = slow.clone();
    settled.effects.clear();
    let full = still(&settled, down)[21] - 100.0;
    let mut pipeline = Pipeline::new(slow).unwrap();
    pipeline.step(Moment::at(0.0), &up);
    pipeline.step(Moment::at(0.0), &down);
    (full, moments_s.iter().map(|t_s| (pipeline.step(Moment::at(*t_s), &down)[21] - 100.0) / full).collect())
}

#[test]
fn a_kernel_averages_the_past_and_follows_wholly_in_the_end() {
    let slow = simulator([free("low-pass", [], &[0.1, 0.2], &[0.5, 0.3])]);
    // Shares of what is seen of the jump: that of the present, and of each delay once it has passed.
    let (full, seen) = after_a_jump(&slow, &[0.05, 0.15, 0.25, 5.0]);
    assert!(full > 100.0);
    for (got, want) in seen.iter().zip([0.2, 0.7, 1.0, 1.0]) {
        assert!((got - want).abs() < 1e-9, "{seen:?}");
    }
}

#[test]
fn one_part_is_a_delay_at_any_moments() {
    let late = simulator([free("low-pass", [], &[0.1], &[1.0])]);
    let mut plain = late.clone();
    plain.effects.clear();
    let (mut pipeline, mut before) = (Pipeline::new(&late).unwrap(), Pipeline::new(&plain).unwrap());
    // A tip that goes down slowly, at moments of any distance, gives what it gave a tenth of a second before.
    let depth_mm = |t_s: f64| 0.1 + 0.02 * t_s.max(0.0);
    let moments_s = [0.0, 0.03, 0.1, 0.11, 0.2, 0.24, 0.25, 0.4, 0.41, 0.7, 1.5];
    for (place, t_s) in moments_s.into_iter().enumerate() {
        let got = pipeline.step(Moment::at(t_s), &upon(&late, 21, depth_mm(t_s)))[21];
        let want = before.step(Moment::at(t_s), &upon(&late, 21, depth_mm(t_s - 0.1)))[21];
        // Between moments counts run on a straight line, and here they nearly do.
        assert!((got - want).abs() < 0.01, "moment {place}: {got} {want}");
    }
}

#[test]
fn the_formula_as_a_kernel_is_nearly_the_formula() {
    let at_s: Vec<f64> = (1..=64).map(|k| 0.01 * f64::from(k)).collect();
    let curve = Definition::find("low-pass").unwrap().curve.as_ref().unwrap();
    let shares = (curve.formula)(&[0.1], &at_s);
    assert!(shares.iter().sum::<f64>() < 1.0);
    let (_, by_kernel) = after_a_jump(&simulator([free("low-pass", [], &at_s, &shares)]), &[0.05, 0.1, 0.3]);
    for (got, t_s) in by_kernel.iter().zip([0.05, 0.1, 0.3]) {
        let want = 1.0 - (-t_s / 0.1_f64).exp();
        assert!((got - want).abs() < 0.06, "after {t_s} s: {got} {want}");
    }
}
