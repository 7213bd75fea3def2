//! `imprint`: a dent stays after release and recovers slowly.
//!
//! ```text
//! m(t) = greatest over the past s of u(s) exp(-(t - s) / recovery)
//! u   -> max(u, set_share m)
//! ```
//!
//! The dent is a share of the deepest, each element's own, and recovers exponentially. A tool that stands deeper than
//! the dent feels nothing of it: readings under load are the base model's.
//!
//! Derivatives in closed form, with memory. Cost: an exponential a moment.
//!
//! # Source
//! Compression set of rubber, as ISO 815 measures it; the Kelvin-Voigt element's recovery, J. D. Ferry, *Viscoelastic
//! Properties of Polymers* (1980), chapter 1.

use super::{Base, Definition, Make, Now, OnCovering, Parameter};
use crate::Contact;

pub(super) static DEFINITION: Definition = Definition {
    name: "imprint",
    summary: "a response is left after release and recovers slowly",
    parameters: &[
        Parameter::real("set_share", 0.0, [0.0, 1.0]),
        Parameter::real("recovery_s", 60.0, [0.1, 1e5]),
    ],
    near_twins: &["baseline-drift", "relaxation", "hysteresis", "low-pass"],
    shown_by: &["hold", "repeats"],
    make: Make::Covering(|values| {
        Box::new(Imprint { set_share: values[0], recovery_s: values[1], dents: Vec::new() })
    }),
};

#[derive(Debug)]
struct Imprint {
    set_share: f64,
    recovery_s: f64,
    /// Of each element.
    dents: Vec<Dent>,
}

/// What is left of the deepest.
#[derive(Debug, Clone, Copy, Default)]
struct Dent {
    /// The signal before.
    before_mm: f64,
    left_mm: f64,
    /// For how long it has been recovering.
    age_s: f64,
}

impl OnCovering for Imprint {
    fn signal(&mut self, now: Now<'_>, _: &Contact, signal_mm: &mut [f64]) {
        self.dents.resize(signal_mm.len(), Dent::default());
        let left = (-now.dt_s / self.recovery_s).exp();
        for (u, dent) in signal_mm.iter_mut().zip(&mut self.dents) {
            dent.follow(*u, now.dt_s, left, self.recovery_s);
            let set_mm = self.set_share * dent.left_mm;
            if set_mm > u.max(0.0) {
                *u = set_mm;
            }
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
        if parameter > 1 {
            return false;
        }
        for ((slope, u), dent) in slope_mm.iter_mut().zip(before_mm).zip(&self.dents) {
            let set_mm = self.set_share * dent.left_mm;
            *slope = match parameter {
                _ if set_mm < u.max(0.0) => 0.0,
                0 => dent.left_mm,
                _ => set_mm * dent.age_s / self.recovery_s.powi(2),
            };
        }
        true
    }

    fn reset(&mut self) {
        self.dents.clear();
    }
}

impl Dent {
    /// Goes on to `u`, reached on a straight line in `dt_s`, in which a dent falls to the share `left`.
    fn follow(&mut self, u: f64, dt_s: f64, left: f64, recovery_s: f64) {
        let per_s = (self.before_mm - u) / dt_s;
        // A signal that falls sets a new dent until it falls faster than a dent recovers: from here on.
        let turn_mm = per_s * recovery_s;
        if u < turn_mm && turn_mm < self.before_mm {
            let age_s = (turn_mm - u) / per_s;
            *self = self.deepest(turn_mm * (-age_s / recovery_s).exp(), age_s, left, dt_s);
        } else {
            *self = self.deepest(u, 0.0, left, dt_s);
        }
        self.before_mm = u;
    }

    /// The old dent, or a new one that leaves more.
    fn deepest(self, left_mm: f64, age_s: f64, left: f64, dt_s: f64) -> Self {
        let old_mm = self.left_mm * left;
        if left_mm >= old_mm {
            Self { left_mm, age_s, ..self }
        } else {
            Self { left_mm: old_mm, age_s: self.age_s + dt_s, ..self }
        }
    }
}

#[cfg(test)]
#[path = "imprint_tests.rs"]
mod tests;
