//! `relaxation`: the response falls while a depth is held, and comes back after release.
//!
//! ```text
//! u -> u - relaxed_share (q_1 + q_2 + q_3) / 3          q_k' = (u - q_k) / tau_k,  q_k = 0 before the first moment
//!                                                       tau = time_constant {1 / spread_ratio, 1, spread_ratio}
//! ```
//!
//! and not below 0, since a covering does not pull: what is left of `q` after a release shows in the next press.
//! A step to `u` and a hold give, with a ratio of 1, `u (1 - relaxed_share (1 - exp(-t / time_constant)))`: the
//! response at once is the base model's. A negative share creeps upwards, and leaves a rest after release.
//!
//! Three times spread on a scale of ratios follow what relaxes in no single one. Share of the fall that is explained
//! under a depth held from 0.03 to 60 s, the gain free, frames at 30 Hz (without spread, and with):
//!
//! | law | ratio 1 | free |
//! |---|---|---|
//! | power law `t^-0.15` | 0.909 | 0.993 |
//! | power law `t^-0.05` | 0.938 | 0.999 |
//! | Prony series of 0.1, 1, 8 and 40 s | 0.955 | 0.998 |
//! | stretched exponential, exponent 0.5 | 0.976 | 0.999 |
//! | logarithm | 0.957 | 0.998 |
//!
//! Derivatives in closed form, with memory. Cost: three exponentials a moment, some operations an element.
//!
//! # Source
//! The generalised Maxwell solid (a Prony series, here of three terms), in stress under prescribed strain: J. D. Ferry,
//! *Viscoelastic Properties of Polymers* (1980), chapter 1.

use super::lag::SpreadLag;
use super::{Base, Definition, Make, Now, OnCovering, Parameter};
use crate::Contact;

pub(super) static DEFINITION: Definition = Definition {
    name: "relaxation",
    summary: "the response changes while the depth is held",
    parameters: &[
        Parameter::real("relaxed_share", 0.0, [-5.0, 1.0]),
        Parameter::real("time_constant_s", 10.0, [1e-3, 1e5]),
        Parameter::real("spread_ratio", 4.0, [1.0, 100.0]),
    ],
    near_twins: &[
        "low-pass",
        "time-lag",
        "rate-stiffening",
        "imprint",
        "hysteresis",
        "baseline-drift",
        "softening",
    ],
    shown_by: &["hold", "rates", "repeats"],
    make: Make::Covering(|values| {
        Box::new(Relaxation { relaxed_share: values[0], relaxed: SpreadLag::new(values[1], values[2]) })
    }),
};

#[derive(Debug)]
struct Relaxation {
    relaxed_share: f64,
    relaxed: SpreadLag,
}

impl OnCovering for Relaxation {
    fn signal(&mut self, now: Now<'_>, _: &Contact, signal_mm: &mut [f64]) {
        if self.relaxed.has_begun() {
            self.relaxed.follow(now.dt_s, signal_mm);
        } else {
            self.relaxed.begin(&vec![0.0; signal_mm.len()], signal_mm);
        }
        for (element, u) in signal_mm.iter_mut().enumerate() {
            *u = self.left(*u, self.relaxed.output(element)).unwrap_or(u.min(0.0));
        }
    }

    fn slope(
        &self,
        parameter: usize,
        _: Base<'_>,
        _: &Contact,
        before_mm: &[f64],
        slope_mm: &mut [f64],
    ) -> bool {
        let (factor, by): (f64, fn(&SpreadLag, usize) -> f64) = match parameter {
            0 => (-1.0, SpreadLag::output),
            1 => (-self.relaxed_share, SpreadLag::by_tau),
            2 => (-self.relaxed_share, SpreadLag::by_ratio),
            _ => return false,
        };
        for (element, (slope, u)) in slope_mm.iter_mut().zip(before_mm).enumerate() {
            let left = self.left(*u, self.relaxed.output(element));
            *slope = left.map_or(0.0, |_| factor * by(&self.relaxed, element));
        }
        true
    }

    fn reset(&mut self) {
        self.relaxed.reset();
    }
}

impl Relaxation {
    /// What is left of `u`; `None` if the covering would have to pull.
    fn left(&self, u: f64, q: f64) -> Option<f64> {
        let left = u - self.relaxed_share * q;
        (left >= u.min(0.0)).then_some(left)
    }
}

#[cfg(test)]
#[path = "relaxation_tests.rs"]
mod tests;
