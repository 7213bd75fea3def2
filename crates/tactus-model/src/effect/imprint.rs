//! `imprint`: a dent stays after release and recovers slowly.
//!
//! ```text
//! m_k(t) = greatest over the past s of u(s) exp(-(t - s) / tau_k)
//! u     -> u + sum of w_k (m_k - u)
//!
//! w = set_share / 3,  tau = recovery {1 / spread_ratio, 1, spread_ratio}, or both from knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `set_share` | - | 0 | 0 to 1 | share of the deepest signal that is left right after release |
//! | `recovery_s` | s | 60 | 0.1 to 100000 | the middle one of the three recovery times |
//! | `spread_ratio` | - | 4 | 1 to 100 | ratio of one recovery time to the next; at 1 all three are equal |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_s` | s | above 0 | recovery times `tau_k` |
//! | `set_share` | - | 0 to 1 | weight `w_k` of each; replaces all parameters |
//!
//! Each element keeps its own dent, a share of its deepest signal. With a ratio of 1 the dent recovers exponentially; with larger
//! ratios it follows power laws and series, as `relaxation` does. The dent adds to lighter presses. A press as deep as the one
//! before shows nothing of it, since `m_k` is then `u`.
//!
//! Cost: three exponentials a moment, or one for each knot.
//!
//! # Source
//! Compression set of rubber, as ISO 815 measures it; the Kelvin-Voigt element's recovery, J. D. Ferry, *Viscoelastic
//! Properties of Polymers* (1980), chapter 1.

use super::lag::spread;
use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnCovering, Parameter, Rises};
use crate::Contact;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "imprint",
    summary: "a response is left after release and recovers slowly",
    parameters: &[
        Parameter::real("set_share", 0.0, [0.0, 1.0]),
        Parameter::real("recovery_s", 60.0, [0.1, 1e5]),
        Parameter::real("spread_ratio", 4.0, [1.0, 100.0]),
    ],
    near_twins: &["baseline-drift", "relaxation", "hysteresis", "low-pass"],
    acts_by: &[Covariate::SinceRelease, Covariate::DeepestBefore],
    shown_by: &["hold", "repeats"],
    curve: Some(FreeCurve {
        at: "at_s",
        of: "set_share",
        kind: CurveKind::Weights,
        range: [0.0, 1.0],
        rises: Rises::No,
        replaces: &["set_share", "recovery_s", "spread_ratio"],
        formula: |values, at_s| {
            let parts = spread(values[1], values[2]).map(|recovery_s| (recovery_s, values[0] / 3.0));
            Knots::divided(parts, at_s, f64::ln)
        },
    }),
    make: Make::Covering(|values| {
        if let Some(knots) = values.knots() {
            return Box::new(FreeImprint { parts: knots.clone(), dents: Vec::new() });
        }
        let [set_share, recovery_s, spread_ratio] = [values[0], values[1], values[2]];
        Box::new(Imprint { set_share, recovery_s, spread_ratio, dents: Vec::new() })
    }),
};

#[derive(Debug)]
struct Imprint {
    set_share: f64,
    recovery_s: f64,
    spread_ratio: f64,
    /// Of each element, from the fastest to the slowest.
    dents: Vec<[Dent; 3]>,
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
        self.dents.resize(signal_mm.len(), <[Dent; 3]>::default());
        let recoveries = self.recoveries_s().map(|recovery_s| (recovery_s, (-now.dt_s / recovery_s).exp()));
        for (u, dents) in signal_mm.iter_mut().zip(&mut self.dents) {
            for (dent, (recovery_s, left)) in dents.iter_mut().zip(recoveries) {
                dent.follow(*u, now.dt_s, left, recovery_s);
            }
            *u += self.set_share * (left_mm(dents) - u.max(0.0));
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.dents.clear();
    }
}

impl Imprint {
    fn recoveries_s(&self) -> [f64; 3] {
        spread(self.recovery_s, self.spread_ratio)
    }
}

#[derive(Debug)]
struct FreeImprint {
    /// Recovery times and their weights.
    parts: Knots,
    /// Element by element, part by part.
    dents: Vec<Dent>,
}

impl OnCovering for FreeImprint {
    fn signal(&mut self, now: Now<'_>, _: &Contact, signal_mm: &mut [f64]) {
        let Knots { at, values } = &self.parts;
        self.dents.resize(signal_mm.len() * at.len(), Dent::default());
        let parts: Vec<[f64; 3]> =
            at.iter().zip(values).map(|(at_s, weight)| [*at_s, *weight, (-now.dt_s / at_s).exp()]).collect();
        for (u, dents) in signal_mm.iter_mut().zip(self.dents.chunks_exact_mut(parts.len())) {
            let mut rise_mm = 0.0;
            for (dent, [recovery_s, weight, left]) in dents.iter_mut().zip(&parts) {
                dent.follow(*u, now.dt_s, *left, *recovery_s);
                rise_mm += weight * (dent.left_mm - u.max(0.0));
            }
            *u += rise_mm;
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.dents.clear();
    }
}

/// What is left of all three.
fn left_mm(dents: &[Dent; 3]) -> f64 {
    dents.iter().map(|dent| dent.left_mm).sum::<f64>() / 3.0
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
