//! `hysteresis`: load and unload differ, at any rate.
//!
//! ```text
//! l   =  (1 - by_depth) max(0, u) + by_depth depth
//! q_k -> max((l - s_k threshold) / (1 + s_k growth), min((l + s_k threshold) / (1 - s_k growth), q_k))
//! u   -> u - (u / l) sum of w_k (q_k - l)          not below 0
//!
//! w_k = loss_share / 4,  s_k = 1/8, 3/8, 5/8, 1, or w_k and s_k threshold from knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `loss_share` | - | 0 | -1 to 5 | after a turn of the load the response follows `1 + loss_share` times as fast as the base model |
//! | `threshold_mm` | mm | 0.1 | 0.001 to 2 | half width of the widest play at no load |
//! | `threshold_growth` | - | 0.1 | 0 to 0.9 | `growth`: by how much that half width grows for each mm that the play holds |
//! | `by_depth` | - | 0 | 0 to 1 | the load `l` that the plays follow: 0 the element's own signal, 1 the tool's depth; between, their mixture |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_mm` | mm | above 0 | half width of each play at no load; the last is `threshold` |
//! | `loss_share` | - | 0 to 5 | weight `w_k` of each play; replaces `loss_share` and `threshold_mm` |
//!
//! `depth` is that of the tool, from 0 to the covering's thickness. `u / l` is 1 with a `by_depth` of 0, and else 0 where there
//! is no load. Each element has four plays `q_k`, or one for each knot, which begin at 0. A play keeps its value until the load is further from it
//! than `s_k (threshold + growth q_k)`: friction that grows with the load. After a turn the response is faster until the load
//! has crossed the plays, one by one. The loop is closed at any speed. A negative share makes the response late instead, and
//! leaves a rest after release.
//!
//! Share of other loops that is explained, in presses of 0.1 to 0.6 mm with returns halfway, beyond the best gain, baseline and
//! quadratic term, with a `by_depth` of 0:
//!
//! | loop | explained |
//! |---|---|
//! | Bouc-Wen, `z_0` 0.05 mm, `n` 1 and 2 | 1.00, 1.00 |
//! | Bouc-Wen, `z_0` 0.15 mm, `n` 1 and 2 | 0.97, 0.96 |
//! | Prandtl-Ishlinskii, exponential density of 0.03, 0.1 and 0.3 mm | 0.99, 0.98, 1.00 |
//! | the same of stops, 0.1 mm | 0.98 |
//! | Preisach, Gaussian of 0.1 and 0.25 mm, and even density | 0.79, 0.96, 0.97 |
//!
//! Cost: two comparisons for each play of each
//! element.
//!
//! # Source
//! The Prandtl-Ishlinskii operator, a weighted sum of plays: M. Brokate and J. Sprekels, *Hysteresis and Phase
//! Transitions* (1996), chapter 2; plays between two curves, M. A. Krasnosel'skii and A. V. Pokrovskii, *Systems with
//! Hysteresis* (1989), chapter 1.

use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnCovering, Parameter, Rises, Values};
use crate::Contact;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "hysteresis",
    summary: "load and unload differ, independent of rate",
    parameters: &[
        Parameter::real("loss_share", 0.0, [-1.0, 5.0]),
        Parameter::real("threshold_mm", 0.1, [1e-3, 2.0]),
        Parameter::real("threshold_growth", 0.1, [0.0, 0.9]),
        Parameter::real("by_depth", 0.0, [0.0, 1.0]),
    ],
    near_twins: &["backlash", "softening", "relaxation", "imprint", "time-lag", "rate-stiffening"],
    acts_by: &[Covariate::Direction, Covariate::Depth, Covariate::Signal],
    shown_by: &["ladder", "repeats"],
    curve: Some(FreeCurve {
        at: "at_mm",
        of: "loss_share",
        kind: CurveKind::Weights,
        range: [0.0, 5.0],
        rises: Rises::No,
        replaces: &["loss_share", "threshold_mm"],
        formula: |values, at_mm| {
            let parts = SHARES.map(|share| (share * values[1], values[0] / 4.0));
            Knots::divided(parts, at_mm, |at_mm| at_mm)
        },
    }),
    make: Make::Covering(|values| Box::new(Hysteresis::of(values))),
};

/// Half the width of each play, as a share of the widest.
const SHARES: [f64; 4] = [0.125, 0.375, 0.625, 1.0];

#[derive(Debug)]
struct Hysteresis {
    loss_share: f64,
    threshold_mm: f64,
    growth: f64,
    by_depth: f64,
    /// Half the width of each play, as a share of the widest, and its share of the loss.
    kinds: Vec<[f64; 2]>,
    /// Element by element, kind by kind.
    plays: Vec<Play>,
}

/// What holds on to the signal.
#[derive(Debug, Clone, Copy, Default)]
struct Play {
    held_mm: f64,
}

impl OnCovering for Hysteresis {
    fn signal(&mut self, now: Now<'_>, contact: &Contact, signal_mm: &mut [f64]) {
        self.plays.resize(signal_mm.len() * self.kinds.len(), Play::default());
        let [by_depth, by_own] = [self.by_depth, 1.0 - self.by_depth];
        let depth_mm = contact.depth_mm.clamp(0.0, now.base.covering.thickness_mm);
        for (u, plays) in signal_mm.iter_mut().zip(self.plays.chunks_exact_mut(self.kinds.len())) {
            let load_mm = by_own * u.max(0.0) + by_depth * depth_mm;
            for (play, [share, _]) in plays.iter_mut().zip(&self.kinds) {
                play.follow(load_mm, share * self.threshold_mm, share * self.growth);
            }
            let lost = self.loss_share * mean(&self.kinds, plays, |play| play.held_mm - load_mm);
            *u = left(*u, of_own(self.by_depth, *u, load_mm) * lost);
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.plays.clear();
    }
}

impl Hysteresis {
    fn of(values: &Values) -> Self {
        let [loss_share, threshold_mm, growth, by_depth] = [values[0], values[1], values[2], values[3]];
        let formula = Self {
            loss_share,
            threshold_mm,
            growth,
            by_depth,
            kinds: SHARES.map(|share| [share, 1.0 / SHARES.len() as f64]).to_vec(),
            plays: Vec::new(),
        };
        let Some(Knots { at, values: weights }) = values.knots() else { return formula };
        let widest_mm = at.last().copied().unwrap_or_default();
        let kinds = at.iter().zip(weights).map(|(at_mm, weight)| [at_mm / widest_mm, *weight]).collect();
        Self { loss_share: 1.0, threshold_mm: widest_mm, kinds, ..formula }
    }
}

/// The element's share of a loss in the load.
fn of_own(by_depth: f64, u: f64, load_mm: f64) -> f64 {
    if by_depth == 0.0 {
        1.0
    } else if load_mm > 0.0 {
        u / load_mm
    } else {
        0.0
    }
}

impl Play {
    fn follow(&mut self, u: f64, threshold_mm: f64, growth: f64) {
        let least_mm = (u - threshold_mm) / (1.0 + growth);
        let most_mm = (u + threshold_mm) / (1.0 - growth);
        if self.held_mm < least_mm {
            self.held_mm = least_mm;
        } else if self.held_mm > most_mm {
            self.held_mm = most_mm;
        }
    }
}

/// What is left of `u` after a loss; a covering does not pull.
fn left(u: f64, lost: f64) -> f64 {
    (u - lost).max(u.min(0.0))
}

/// The mean over an element's plays, each with its share of the loss.
fn mean(kinds: &[[f64; 2]], plays: &[Play], of: impl Fn(&Play) -> f64) -> f64 {
    kinds.iter().zip(plays).map(|([_, share], play)| share * of(play)).sum()
}

#[cfg(test)]
#[path = "hysteresis_tests.rs"]
mod tests;
