//! `hysteresis`: load and unload differ, at any rate.
//!
//! ```text
//! q_k -> max(u, min(u + r_k, q_k))                         r_k = k threshold / 4,  k = 1 .. 4
//! u   -> u - loss_share * (mean of q_k - u)                not below 0
//! ```
//!
//! Each element has four plays `q_k` that hold on to what was reached. Loading is the base model's; where the load
//! turns, the response falls `1 + loss_share` times as fast at first, and as fast as the base model's once it has
//! come back by the threshold, lower by `loss_share` times 5/8 of it. Loading again takes it back up the same way: a
//! closed loop, however slowly it is gone round. A negative share leaves a rest after release.
//!
//! Derivatives in closed form, with memory. Cost: four comparisons an element.
//!
//! # Source
//! The Prandtl-Ishlinskii operator, a weighted sum of plays: M. Brokate and J. Sprekels, *Hysteresis and Phase
//! Transitions* (1996), chapter 2.

use super::{Base, Definition, Make, Now, OnCovering, Parameter};
use crate::Contact;

pub(super) static DEFINITION: Definition = Definition {
    name: "hysteresis",
    summary: "load and unload differ, independent of rate",
    parameters: &[
        Parameter::real("loss_share", 0.0, [-1.0, 5.0]),
        Parameter::real("threshold_mm", 0.1, [1e-3, 2.0]),
    ],
    near_twins: &["backlash", "softening", "relaxation", "imprint", "time-lag", "rate-stiffening"],
    shown_by: &["ladder", "repeats"],
    make: Make::Covering(|values| {
        let [loss_share, threshold_mm] = [values[0], values[1]];
        Box::new(Hysteresis { loss_share, threshold_mm, plays: Vec::new() })
    }),
};

/// Thresholds of the plays, as shares of the greatest.
const THRESHOLD_SHARES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

#[derive(Debug)]
struct Hysteresis {
    loss_share: f64,
    threshold_mm: f64,
    /// Of each element.
    plays: Vec<[Play; 4]>,
}

/// What holds on to a greater signal, and by how much that changes with the threshold.
#[derive(Debug, Clone, Copy, Default)]
struct Play {
    held_mm: f64,
    by_threshold: f64,
}

impl OnCovering for Hysteresis {
    fn signal(&mut self, _: Now<'_>, _: &Contact, signal_mm: &mut [f64]) {
        self.plays.resize(signal_mm.len(), <[Play; 4]>::default());
        for (u, plays) in signal_mm.iter_mut().zip(&mut self.plays) {
            for (play, share) in plays.iter_mut().zip(THRESHOLD_SHARES) {
                play.follow(*u, share, self.threshold_mm);
            }
            *u = left(*u, self.loss_share * mean(plays.map(|play| play.held_mm - *u)));
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
        for ((slope, u), plays) in slope_mm.iter_mut().zip(before_mm).zip(&self.plays) {
            let lost = mean(plays.map(|play| play.held_mm - u));
            *slope = match parameter {
                _ if u - self.loss_share * lost < u.min(0.0) => 0.0,
                0 => -lost,
                _ => -self.loss_share * mean(plays.map(|play| play.by_threshold)),
            };
        }
        true
    }

    fn reset(&mut self) {
        self.plays.clear();
    }
}

impl Play {
    fn follow(&mut self, u: f64, share: f64, threshold_mm: f64) {
        let most_mm = u + share * threshold_mm;
        if u >= self.held_mm {
            *self = Self { held_mm: u, by_threshold: 0.0 };
        } else if self.held_mm > most_mm {
            *self = Self { held_mm: most_mm, by_threshold: share };
        }
    }
}

/// What is left of `u` after a loss; a covering does not pull.
fn left(u: f64, lost: f64) -> f64 {
    (u - lost).max(u.min(0.0))
}

fn mean(values: [f64; 4]) -> f64 {
    values.iter().sum::<f64>() / 4.0
}

#[cfg(test)]
#[path = "hysteresis_tests.rs"]
mod tests;
