//! `relaxation`: the response falls while a depth is held, and comes back after release.
//!
//! ```text
//! u -> u - relaxed_share q          q' = (u - q) / time_constant,  q = 0 before the first moment
//! ```
//!
//! and not below 0, since a covering does not pull: what is left of `q` after a release shows in the next press.
//! A step to `u` and a hold give `u (1 - relaxed_share (1 - exp(-t / time_constant)))`: the response at once is the
//! base model's. A negative share creeps upwards, and leaves a rest after release.
//!
//! # Source
//! The standard linear solid (one term of a Prony series), in stress under prescribed strain: J. D. Ferry,
//! *Viscoelastic Properties of Polymers* (1980), chapter 1.

use super::lag::Lag;
use super::{Base, Definition, Make, Now, OnCovering, Parameter};
use crate::Contact;

pub(super) static DEFINITION: Definition = Definition {
    name: "relaxation",
    summary: "the response changes while the depth is held",
    parameters: &[
        Parameter::real("relaxed_share", 0.0, [-5.0, 1.0]),
        Parameter::real("time_constant_s", 10.0, [1e-3, 1e5]),
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
        Box::new(Relaxation { relaxed_share: values[0], relaxed: Lag::new(values[1]) })
    }),
};

#[derive(Debug)]
struct Relaxation {
    relaxed_share: f64,
    relaxed: Lag,
}

impl OnCovering for Relaxation {
    fn signal(&mut self, now: Now<'_>, _: &Contact, signal_mm: &mut [f64]) {
        if self.relaxed.has_begun() {
            self.relaxed.follow(now.dt_s, signal_mm);
        } else {
            self.relaxed.begin(&vec![0.0; signal_mm.len()], signal_mm);
        }
        for (u, q) in signal_mm.iter_mut().zip(self.relaxed.output()) {
            *u = self.left(*u, *q).unwrap_or(u.min(0.0));
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
        let (factor, of) = match parameter {
            0 => (-1.0, self.relaxed.output()),
            1 => (-self.relaxed_share, self.relaxed.by_tau()),
            _ => return false,
        };
        let pasts = self.relaxed.output().iter().zip(of);
        for ((slope, u), (q, by)) in slope_mm.iter_mut().zip(before_mm).zip(pasts) {
            *slope = self.left(*u, *q).map_or(0.0, |_| factor * by);
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
