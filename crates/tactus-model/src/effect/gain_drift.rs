//! `gain-drift`: the sensitivity of all elements changes with time or temperature.
//!
//! ```text
//! counts -> counts + (counts - baseline) (rate t + per_k (T - T_0))          t since the start
//! ```
//!
//! `T_0` is the first temperature that is known; without one temperature does nothing.
//!
//! Derivatives in closed form. Cost: none.
//!
//! # Source
//! Sensitivity drift of an instrument: A. S. Morris and R. Langari, *Measurement and Instrumentation* (2012),
//! chapter 2.

use super::{Definition, Make, Now, OnReadout, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "gain-drift",
    summary: "the sensitivity changes with time or temperature",
    parameters: &[
        Parameter::real("rate_per_h", 0.0, [-10.0, 10.0]),
        Parameter::real("rate_per_k", 0.0, [-0.1, 0.1]),
    ],
    near_twins: &["misregistration", "surface-tilt", "softening", "baseline-drift"],
    shown_by: &["repeats", "element-centres"],
    make: Make::Readout(|values| {
        Box::new(GainDrift {
            rate_per_h: values[0],
            rate_per_k: values[1],
            first_c: None,
            last: [0.0; 2],
            rise_counts: Vec::new(),
        })
    }),
};

#[derive(Debug)]
struct GainDrift {
    rate_per_h: f64,
    rate_per_k: f64,
    first_c: Option<f64>,
    /// Hours since the start and kelvins above the first temperature, at the last moment.
    last: [f64; 2],
    /// What stood above the baselines then.
    rise_counts: Vec<f64>,
}

impl OnReadout for GainDrift {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        self.first_c = self.first_c.or(now.temperature_c);
        let warmer_k = now.temperature_c.zip(self.first_c).map_or(0.0, |(now_c, first_c)| now_c - first_c);
        self.last = [now.t_s / 3600.0, warmer_k];
        let gain = self.rate_per_h * self.last[0] + self.rate_per_k * self.last[1];
        let baselines = &now.base.model.response().baseline_counts;
        self.rise_counts.clear();
        self.rise_counts.extend(counts.iter().zip(baselines).map(|(count, baseline)| count - baseline));
        for (count, rise) in counts.iter_mut().zip(&self.rise_counts) {
            *count += rise * gain;
        }
    }

    fn slope(&self, parameter: usize, slope_counts: &mut [f64]) -> bool {
        let Some(by) = self.last.get(parameter) else { return false };
        for (slope, rise) in slope_counts.iter_mut().zip(&self.rise_counts) {
            *slope = rise * by;
        }
        true
    }

    fn reset(&mut self) {
        self.first_c = None;
    }
}

#[cfg(test)]
#[path = "gain_drift_tests.rs"]
mod tests;
