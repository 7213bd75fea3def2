//! Detects a converter that is coarser than declared: its readings lie on a lattice of wider steps.
//!
//! Means do not show this, nor do residuals if noise dithers; single readings do. The probability that `n` different
//! readings lie on a lattice of `q` declared steps by chance is `(1 / q)^(n - 2)`.

use std::collections::BTreeSet;

use super::frames::Frames;

/// Least number of different readings; fewer may lie on a lattice by chance.
const READINGS_LEAST: usize = 20;
/// Least ratio of the lattice's step to the declared one.
const WIDER: f64 = 1.4;
/// Greatest distance of a reading from the lattice, as a share of a step.
const OFF_MAX: f64 = 0.02;

/// The step of the readings in counts, if it is wider than declared, and its p-value.
pub(crate) fn wider_step(frames: &Frames, declared_counts: f64) -> Option<(f64, f64)> {
    let different: BTreeSet<u32> = frames.counts.iter().map(|counts| counts.to_bits()).collect();
    let mut readings: Vec<f64> = different.into_iter().map(|bits| f64::from(f32::from_bits(bits))).collect();
    readings.sort_by(f64::total_cmp);
    if readings.len() < READINGS_LEAST {
        return None;
    }
    let step = readings.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    if step < WIDER * declared_counts.max(f64::MIN_POSITIVE) {
        return None;
    }
    // The full scale need not be a whole number of steps.
    let off = readings[..readings.len() - 1].iter().filter(|reading| {
        let steps = (*reading - readings[0]) / step;
        (steps - steps.round()).abs() > OFF_MAX
    });
    (off.count() == 0).then(|| {
        let chance = (declared_counts / step).max(1e-3).powf(readings.len() as f64 - 2.0);
        (step, chance.max(f64::MIN_POSITIVE))
    })
}

#[cfg(test)]
#[path = "lattice_tests.rs"]
mod tests;
