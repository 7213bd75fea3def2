//! `baseline-drift`: the zero of all elements wanders in time.
//!
//! ```text
//! counts -> counts + rate t + warm_up (1 - exp(-t / time_constant))          t since the start
//! ```
//!
//! A drift that goes on, and one that settles. Both together bend as slow drifts do over a run.
//!
//! Derivatives in closed form. Cost: none.
//!
//! # Source
//! Warming up of a lumped thermal mass (Newton's law of cooling), and its long-term rest: A. S. Morris and R. Langari,
//! *Measurement and Instrumentation* (2012), chapter 2, zero drift.

use super::{Definition, Make, Now, OnReadout, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "baseline-drift",
    summary: "the zero wanders in time",
    parameters: &[
        Parameter::real("rate_counts_per_s", 0.0, [-10.0, 10.0]),
        Parameter::real("warm_up_counts", 0.0, [-1000.0, 1000.0]),
        Parameter::real("time_constant_s", 300.0, [1.0, 1e4]),
    ],
    near_twins: &["imprint", "relaxation", "gain-drift", "periodic-interference"],
    shown_by: &["drift"],
    make: Make::Readout(|values| {
        let [rate_counts_per_s, warm_up_counts, time_constant_s] = [values[0], values[1], values[2]];
        Box::new(BaselineDrift { rate_counts_per_s, warm_up_counts, time_constant_s, t_s: 0.0 })
    }),
};

#[derive(Debug)]
struct BaselineDrift {
    rate_counts_per_s: f64,
    warm_up_counts: f64,
    time_constant_s: f64,
    /// Of the last moment.
    t_s: f64,
}

impl OnReadout for BaselineDrift {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        self.t_s = now.t_s;
        let drift_counts = self.rate_counts_per_s * now.t_s + self.warm_up_counts * self.warmed_share();
        for count in counts {
            *count += drift_counts;
        }
    }

    fn slope(&self, parameter: usize, slope_counts: &mut [f64]) -> bool {
        let slope = match parameter {
            0 => self.t_s,
            1 => self.warmed_share(),
            2 => {
                let x = self.t_s / self.time_constant_s;
                -self.warm_up_counts * x * (-x).exp() / self.time_constant_s
            }
            _ => return false,
        };
        slope_counts.fill(slope);
        true
    }
}

impl BaselineDrift {
    fn warmed_share(&self) -> f64 {
        -(-self.t_s / self.time_constant_s).exp_m1()
    }
}

#[cfg(test)]
#[path = "baseline_drift_tests.rs"]
mod tests;
