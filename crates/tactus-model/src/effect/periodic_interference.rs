//! `periodic-interference`: a tone is added to the readings.
//!
//! ```text
//! counts -> counts + sine sin(a) + cosine cos(a)          a = 2 pi frequency t + column phase_per_column
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `sine_counts` | counts | 0 | any | amplitude of the sine |
//! | `cosine_counts` | counts | 0 | any | amplitude of the cosine |
//! | `frequency_hz` | Hz | 10 | 0.001 to 1000 | frequency of the tone |
//! | `phase_per_column_deg` | degree | 0 | -180 to 180 | phase from one column to the next |
//!
//! The tone is the same on all elements of a column. From column to column, in the order in which they are read, its phase
//! may differ. Sine and cosine replace amplitude and phase because they act linearly. A tone above half the frame rate
//! shows as its alias below it.
//!
//! Cost: a sine and a cosine for each column.
//!
//! # Source
//! Pick-up of the mains and its alias under uniform sampling: W. Kester (ed.), *The Data Conversion Handbook* (2005),
//! chapter 2.

use std::f64::consts::TAU;

use super::{Definition, Make, Now, OnReadout, Parameter};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "periodic-interference",
    summary: "a tone is added, such as an alias of the mains",
    parameters: &[
        Parameter::counts("sine_counts"),
        Parameter::counts("cosine_counts"),
        Parameter::real("frequency_hz", 10.0, [1e-3, 1000.0]),
        Parameter::real("phase_per_column_deg", 0.0, [-180.0, 180.0]),
    ],
    near_twins: &["baseline-drift", "noise_rms_counts"],
    acts_by: &[Covariate::Time],
    shown_by: &["drift", "hold"],
    curve: None,
    make: Make::Readout(|values| {
        let [sine_counts, cosine_counts, frequency_hz] = [values[0], values[1], values[2]];
        let phase_per_column = values[3].to_radians();
        Box::new(PeriodicInterference {
            sine_counts,
            cosine_counts,
            frequency_hz,
            phase_per_column,
            t_s: 0.0,
            cols: 1,
        })
    }),
};

#[derive(Debug)]
struct PeriodicInterference {
    sine_counts: f64,
    cosine_counts: f64,
    frequency_hz: f64,
    phase_per_column: f64,
    /// Of the last moment.
    t_s: f64,
    cols: usize,
}

impl OnReadout for PeriodicInterference {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        (self.t_s, self.cols) = (now.t_s, now.base.model.array().cols());
        let tone = |(_, sin, cos)| self.sine_counts * sin + self.cosine_counts * cos;
        let tones = self.columns().map(tone);
        for (count, tone) in counts.iter_mut().zip(tones.collect::<Vec<_>>().iter().cycle()) {
            *count += tone;
        }
    }

    fn is_timed(&self) -> bool {
        true
    }
}

impl PeriodicInterference {
    /// Of each column its index, and the sine and cosine of its phase at the last moment.
    fn columns(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        (0..self.cols).map(|col| {
            let (sin, cos) =
                (TAU * self.frequency_hz * self.t_s + col as f64 * self.phase_per_column).sin_cos();
            (col as f64, sin, cos)
        })
    }
}

#[cfg(test)]
#[path = "periodic_interference_tests.rs"]
mod tests;
