//! `baseline-drift`: the zero of all elements wanders in time.
//!
//! ```text
//! counts -> counts + c(t)          t since the start
//! c straight through 0 and offset_01_counts .. offset_16_counts, duration / 16 apart, and constant after the duration
//! ```
//!
//! The start is at 0, since the baselines are the base model's. A wander of any
//! shape is followed, be it a trend, a warming up or a random walk, of which least squares leave 4 % of the variance;
//! 12 knots would leave 5 % and 6 knots 10 %. What is faster than a sixteenth of the duration is not.
//!
//! Derivatives in closed form. Cost: none.
//!
//! # Source
//! Linear splines: C. de Boor, *A Practical Guide to Splines* (2001), chapter 3. Zero drift of an instrument: A. S.
//! Morris and R. Langari, *Measurement and Instrumentation* (2012), chapter 2.

use super::curve::Curve;
use super::{Definition, Make, Now, OnReadout, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "baseline-drift",
    summary: "the zero wanders in time",
    parameters: &[
        Parameter::real("duration_s", 600.0, [1.0, 1e6]),
        offset("offset_01_counts"),
        offset("offset_02_counts"),
        offset("offset_03_counts"),
        offset("offset_04_counts"),
        offset("offset_05_counts"),
        offset("offset_06_counts"),
        offset("offset_07_counts"),
        offset("offset_08_counts"),
        offset("offset_09_counts"),
        offset("offset_10_counts"),
        offset("offset_11_counts"),
        offset("offset_12_counts"),
        offset("offset_13_counts"),
        offset("offset_14_counts"),
        offset("offset_15_counts"),
        offset("offset_16_counts"),
    ],
    near_twins: &["imprint", "relaxation", "gain-drift", "periodic-interference"],
    shown_by: &["drift"],
    make: Make::Readout(|values| {
        Box::new(BaselineDrift { zero_counts: Curve::new(values[0], &values[1..]), t_s: 0.0 })
    }),
};

const fn offset(name: &'static str) -> Parameter {
    Parameter::real(name, 0.0, [-1000.0, 1000.0])
}

#[derive(Debug)]
struct BaselineDrift {
    zero_counts: Curve<16>,
    /// Of the last moment.
    t_s: f64,
}

impl OnReadout for BaselineDrift {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        self.t_s = now.t_s;
        let drift_counts = self.zero_counts.at(now.t_s);
        for count in counts {
            *count += drift_counts;
        }
    }

    fn slope(&self, parameter: usize, slope_counts: &mut [f64]) -> bool {
        slope_counts.fill(match parameter {
            0 => self.zero_counts.by_duration(self.t_s),
            1..=16 => self.zero_counts.by_knot(parameter - 1, self.t_s),
            _ => return false,
        });
        true
    }
}

#[cfg(test)]
#[path = "baseline_drift_tests.rs"]
mod tests;
