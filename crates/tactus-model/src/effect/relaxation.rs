//! `relaxation`: the response falls while a depth is held, and comes back after release.
//!
//! ```text
//! u -> u - f sum of w_k q_k        q_k' = (u - q_k) / tau_k,  q_k = 0 before the first moment
//!
//! f = 1 - by_depth + by_depth depth / thickness
//! w = relaxed_share / 3,  tau = time_constant {1 / spread_ratio, 1, spread_ratio}, or both from knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `relaxed_share` | - | 0 | -5 to 1 | share of the response that a long hold loses; negative: the response creeps upwards |
//! | `time_constant_s` | s | 10 | 0.001 to 100000 | the middle one of the three time constants |
//! | `spread_ratio` | - | 4 | 1 to 100 | ratio of one time constant to the next; at 1 all three are equal |
//! | `after_release` | - | 0.5 | 0 to 1 | share of the change that still shows without contact |
//! | `recovery_ratio` | - | 1.5 | 1 to 1000 | speed of the recovery without contact, over that of the relaxation |
//! | `by_depth` | - | 0 | 0 to 1 | how much of the change grows with the depth: 0 in a linear solid; 1: the deeper, the larger the share that flows; may be left out |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_s` | s | above 0 | time constants `tau_k` |
//! | `relaxed_share` | - | 0 to 1 | weight `w_k` of each: the share that a long hold loses by it; replaces `relaxed_share`, `time_constant_s` and `spread_ratio` |
//!
//! While the tool touches, the result is not below 0, since a covering does not pull. After release the share
//! `after_release` of the change still shows: 0 where the covering is no longer touched, so that the change shows only in the
//! next press; 1 in a linear solid. With a large `recovery_ratio` each press begins anew. A step to `u` and a hold give,
//! with a ratio of 1, `u (1 - relaxed_share (1 - exp(-t / time_constant)))`: the response at first is the base model's.
//!
//! Three time constants follow a relaxation that has no single one. This share of the fall is explained under a depth held
//! from 0.03 to 60 s, with a free gain and frames at 30 Hz:
//!
//! | law | ratio 1 | free ratio |
//! |---|---|---|
//! | power law `t^-0.15` | 0.909 | 0.993 |
//! | power law `t^-0.05` | 0.938 | 0.999 |
//! | Prony series of 0.1, 1, 8 and 40 s | 0.955 | 0.998 |
//! | stretched exponential, exponent 0.5 | 0.976 | 0.999 |
//! | logarithm | 0.957 | 0.998 |
//!
//! Cost: three exponentials a moment, or one for each knot; some operations an element.
//!
//! # Source
//! The generalised Maxwell solid (a Prony series, here of three terms), in stress under prescribed strain: J. D. Ferry,
//! *Viscoelastic Properties of Polymers* (1980), chapter 1. A factor of the load on the hereditary part: R. A. Schapery, *Polymer Engineering &
//! Science* 9, 295 (1969).

use super::lag::{Lags, spread};
use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnCovering, Parameter, Rises};
use crate::Contact;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "relaxation",
    summary: "the response changes while the depth is held",
    parameters: &[
        Parameter::real("relaxed_share", 0.0, [-5.0, 1.0]),
        Parameter::real("time_constant_s", 10.0, [1e-3, 1e5]),
        Parameter::real("spread_ratio", 4.0, [1.0, 100.0]),
        Parameter::real("after_release", 0.5, [0.0, 1.0]),
        Parameter::real("recovery_ratio", 1.5, [1.0, 1000.0]),
        Parameter::real("by_depth", 0.0, [0.0, 1.0]).or_neutral(),
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
    acts_by: &[Covariate::SinceContact, Covariate::SinceRelease, Covariate::SinceTurn, Covariate::Depth],
    shown_by: &["hold", "rates", "repeats"],
    curve: Some(FreeCurve {
        at: "at_s",
        of: "relaxed_share",
        kind: CurveKind::Weights,
        range: [0.0, 1.0],
        rises: Rises::No,
        replaces: &["relaxed_share", "time_constant_s", "spread_ratio"],
        formula: |values, at_s| {
            let parts = spread(values[1], values[2]).map(|tau_s| (tau_s, values[0] / 3.0));
            Knots::divided(parts, at_s, f64::ln)
        },
    }),
    make: Make::Covering(|values| {
        let relaxed = match values.knots() {
            Some(Knots { at, values }) => Lags::new(at.iter().copied().zip(values.iter().copied())),
            None => Lags::new(spread(values[1], values[2]).map(|tau_s| (tau_s, values[0] / 3.0))),
        };
        Box::new(Relaxation {
            relaxed,
            after_release: values[3],
            recovery_ratio: values[4],
            by_depth: values[5],
        })
    }),
};

#[derive(Debug)]
struct Relaxation {
    /// What each element has lost, in mm.
    relaxed: Lags,
    after_release: f64,
    recovery_ratio: f64,
    by_depth: f64,
}

impl OnCovering for Relaxation {
    fn signal(&mut self, now: Now<'_>, contact: &Contact, signal_mm: &mut [f64]) {
        let is_pressed = contact.depth_mm > 0.0;
        if self.relaxed.has_begun() {
            let haste = if is_pressed { 1.0 } else { self.recovery_ratio };
            self.relaxed.follow(haste * now.dt_s, signal_mm);
        } else {
            self.relaxed.begin(&vec![0.0; signal_mm.len()], signal_mm);
        }
        let depth_share = (contact.depth_mm / now.base.covering.thickness_mm).clamp(0.0, 1.0);
        let shows = 1.0 - self.by_depth + self.by_depth * depth_share;
        for (u, lost) in signal_mm.iter_mut().zip(self.relaxed.output()) {
            let lost = shows * lost;
            // A covering does not pull.
            *u = if is_pressed { (*u - lost).max(u.min(0.0)) } else { *u - self.after_release * lost };
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.relaxed.reset();
    }
}

#[cfg(test)]
#[path = "relaxation_tests.rs"]
mod tests;
