//! The element's output: noise, saturation, quantisation, in that order of physical cause.

use crate::Array;

/// A full scale of whole steps may be a hair less than that after a division.
const STEPS_ROUNDED: f64 = 1e-9;

/// The converter behind every element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readout {
    full_scale_counts: f64,
    step_counts: f64,
}

impl Readout {
    /// The converter that an array's description states.
    pub fn of(array: &Array) -> Self {
        Self { full_scale_counts: array.full_scale_counts(), step_counts: array.step_counts() }
    }

    /// The reading for `counts` plus `noise_counts`, a noise sample that the caller draws: limited to 0 and full scale, and
    /// rounded to the nearest step.
    pub fn read(&self, counts: f64, noise_counts: f64) -> f64 {
        let most_steps = (self.full_scale_counts / self.step_counts * (1.0 + STEPS_ROUNDED)).floor();
        let steps = ((counts + noise_counts) / self.step_counts).clamp(0.0, most_steps);
        steps.round() * self.step_counts
    }
}

#[cfg(test)]
#[path = "readout_tests.rs"]
mod tests;
