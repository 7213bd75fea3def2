//! The element's output: noise, saturation, quantisation, in that order of physical cause.

use crate::Array;

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

    /// What is read of `counts` when `noise_counts` of noise come upon it: within 0 and full scale, in
    /// whole steps, nearest first.
    ///
    /// The noise is a sample that the caller draws.
    pub fn read(&self, counts: f64, noise_counts: f64) -> f64 {
        let most_steps = (self.full_scale_counts / self.step_counts).floor();
        let steps = ((counts + noise_counts) / self.step_counts).clamp(0.0, most_steps);
        steps.round() * self.step_counts
    }
}

#[cfg(test)]
#[path = "readout_tests.rs"]
mod tests;
