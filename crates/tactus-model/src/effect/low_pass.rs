//! `low-pass`: the readout follows with a first-order lag, or with any kernel of the past.
//!
//! ```text
//! c' = (counts - c) / time_constant          settled at the first moment
//!
//! c(t) = (1 - sum of w_k) counts(t) + sum of w_k counts(t - d_k)          with knots
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `time_constant_s` | s | 0 | 0 to 10 | time constant of the filter; at 0 it follows at once |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `delay_s` | s | above 0 | how long ago `d_k` |
//! | `past_share` | - | 0 to 1 | share `w_k` of a reading that is of then; replaces the time constant |
//!
//! The kernel is causal, and a reading that rests is followed wholly: it is an average of the past. Filters of any order that do not
//! overshoot, moving averages and a plain delay are kernels. A filter that rings is none. If the shares add up to more than 1, they are
//! divided by their sum. Between two moments counts run on a straight line; before the first they were as they were there.
//!
//! Cost: a line through two moments for each knot and element.
//!
//! # Source
//! The first-order filter of a charge amplifier or of the controller's averaging; the impulse response of a linear system, K. J. Astrom and
//! R. M. Murray, *Feedback Systems* (2008).

use std::collections::VecDeque;

use super::lag::Lags;
use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnReadout, Parameter, Rises};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "low-pass",
    summary: "the readout is slow",
    parameters: &[Parameter::real("time_constant_s", 0.0, [0.0, 10.0])],
    near_twins: &["time-lag", "relaxation", "scan-skew", "rate-stiffening", "imprint"],
    acts_by: &[Covariate::SinceTurn, Covariate::Speed, Covariate::TravelSpeed, Covariate::Direction],
    shown_by: &["rates", "ladder"],
    curve: Some(FreeCurve {
        at: "delay_s",
        of: "past_share",
        kind: CurveKind::Weights,
        range: [0.0, 1.0],
        rises: Rises::No,
        replaces: &["time_constant_s"],
        formula: |values, delay_s| exponential(values[0], delay_s),
    }),
    make: Make::Readout(|values| match values.knots() {
        Some(Knots { at, values }) => Box::new(Kernel::of(at, values)),
        None => Box::new(LowPass { lag: Lags::new([(values[0], 1.0)]) }),
    }),
};

/// The shares of a first-order lag: what it weighs from halfway to the delay before to halfway to the one after, and of the last all before.
fn exponential(time_constant_s: f64, delay_s: &[f64]) -> Vec<f64> {
    let left = |s: f64| if time_constant_s > 0.0 { (-s / time_constant_s).exp() } else { 0.0 };
    let between = |place: usize| {
        let before_s = place.checked_sub(1).map_or(0.0, |before| delay_s[before]);
        delay_s.get(place).map_or(f64::INFINITY, |at_s| f64::midpoint(before_s, *at_s))
    };
    (0..delay_s.len()).map(|place| left(between(place)) - left(between(place + 1))).collect()
}

#[derive(Debug)]
struct LowPass {
    lag: Lags,
}

impl OnReadout for LowPass {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        if self.lag.has_begun() {
            self.lag.follow(now.dt_s, counts);
        } else {
            self.lag.begin(counts, counts);
        }
        counts.copy_from_slice(self.lag.output());
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.lag.reset();
    }
}

#[derive(Debug)]
struct Kernel {
    /// How long ago, in s, the shortest first, and the share of a reading that is of then.
    parts: Vec<(f64, f64)>,
    /// Moments as far back as any part, and one before: how long ago each was, in s, the last first, and its counts.
    past: VecDeque<(f64, Vec<f64>)>,
}

impl Kernel {
    fn of(delays_s: &[f64], shares: &[f64]) -> Self {
        let all: f64 = shares.iter().sum();
        let parts = delays_s.iter().zip(shares).map(|(delay_s, share)| (*delay_s, share / all.max(1.0)));
        Self { parts: parts.filter(|(_, share)| *share != 0.0).collect(), past: VecDeque::new() }
    }

    /// Adds the present counts to the past, and forgets what no part reaches.
    fn go_on(&mut self, dt_s: f64, counts: &[f64]) {
        self.past.iter_mut().for_each(|(ago_s, _)| *ago_s += dt_s);
        let longest_s = self.parts.last().map_or(0.0, |(delay_s, _)| *delay_s);
        // Of the moments beyond the longest delay the nearest is needed; its memory serves the present.
        let mut spare = Vec::new();
        while self.past.len() > 1 && self.past[self.past.len() - 2].0 >= longest_s {
            spare = self.past.pop_back().map_or_else(Vec::new, |(_, counts)| counts);
        }
        spare.clear();
        spare.extend_from_slice(counts);
        self.past.push_front((0.0, spare));
    }

    /// The moment after and the moment before a time ago, and how far it is from the first to the second, 0 to 1.
    fn around(&self, delay_s: f64) -> Option<(&[f64], &[f64], f64)> {
        let before = self.past.partition_point(|(ago_s, _)| *ago_s < delay_s).min(self.past.len() - 1);
        let (after_s, after) = self.past.get(before.saturating_sub(1))?;
        let (before_s, before) = self.past.get(before)?;
        let share = if before_s > after_s { (delay_s - after_s) / (before_s - after_s) } else { 1.0 };
        Some((after, before, share.min(1.0)))
    }
}

impl OnReadout for Kernel {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        if self.parts.is_empty() {
            return;
        }
        self.go_on(now.dt_s, counts);
        let Some((_, present)) = self.past.front() else { return };
        for (delay_s, weight) in &self.parts {
            let Some((after, before, share)) = self.around(*delay_s) else { continue };
            for (((c, present), after), before) in counts.iter_mut().zip(present).zip(after).zip(before) {
                *c += weight * (after + share * (before - after) - present);
            }
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.past.clear();
    }
}

#[cfg(test)]
#[path = "low_pass_tests.rs"]
mod tests;
