//! The element's output: noise, saturation, quantisation, in that order of physical cause.

use crate::Array;

/// A full scale of whole steps may be a hair less than that after a division.
const STEPS_ROUNDED: f64 = 1e-9;

/// The converter behind every element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readout {
    /// The least and the greatest reading, in whole steps.
    ends_steps: [f64; 2],
    step_counts: f64,
}

impl Readout {
    /// The converter that an array's description states.
    pub fn of(array: &Array) -> Self {
        let step_counts = array.step_counts();
        let [least, most] = [array.least_counts(), array.full_scale_counts()].map(|end| end / step_counts);
        let ends_steps =
            [(least - STEPS_ROUNDED * least.abs()).ceil(), (most + STEPS_ROUNDED * most.abs()).floor()];
        Self { ends_steps, step_counts }
    }

    /// The reading for `counts` plus `noise_counts`, a noise sample that the caller draws: limited to the array's least and greatest, and
    /// rounded to the nearest step.
    pub fn read(&self, counts: f64, noise_counts: f64) -> f64 {
        let [least, most] = self.ends_steps;
        let steps = ((counts + noise_counts) / self.step_counts).clamp(least.min(most), most);
        steps.round() * self.step_counts
    }
}

#[cfg(test)]
#[path = "readout_tests.rs"]
mod tests;
