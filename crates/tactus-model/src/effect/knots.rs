//! Free curves: knots that stand in place of an effect's formula.
//!
//! An effect of the library is a class: what it acts on and what holds it, such as a response that only grows with depth. Its formula is
//! one member of the class, and a curve through knots is any member. At each place that is listed the curve has the listed value:
//!
//! | kind | between the knots |
//! |---|---|
//! | [`CurveKind::Line`] | straight lines from 0 at 0 through the knots; constant after the last |
//! | [`CurveKind::LogLine`] | the same over the logarithm of the place; a straight line from 0 at 0 to the first knot |
//! | [`CurveKind::Weights`] | nothing: each place has a part of its own, such as a relaxation time, with the value as its weight |
//!
//! Where all values are 0 the effect changes nothing, to the bit.

use std::ops::Deref;

use super::EffectError;
use super::table::Table;

/// The free curve that an effect may have in place of its formula.
#[derive(Debug)]
pub struct FreeCurve {
    /// Key of the places in a model file: `at`, and their unit.
    pub at: &'static str,
    /// Key of the values in a model file.
    pub of: &'static str,
    /// What lies between the knots.
    pub kind: CurveKind,
    /// Least and greatest value; 0 is among them.
    pub range: [f64; 2],
    /// What must not fall from knot to knot.
    pub rises: Rises,
    /// The parameters of the formula that the curve replaces. The others act beside it.
    pub replaces: &'static [&'static str],
    /// The formula's values at places, from one value for each parameter: where a fit of the knots starts.
    pub formula: fn(&[f64], &[f64]) -> Vec<f64>,
}

/// What lies between the knots of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the module says it")]
pub enum CurveKind {
    Line,
    LogLine,
    Weights,
}

/// What of a curve must not fall from knot to knot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rises {
    /// Nothing.
    No,
    /// Its value.
    Value,
    /// Its value times the place: what the effect adds.
    ValueTimesPlace,
}

/// Places, and a curve's value at each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Knots {
    /// Above 0, each greater than the one before; in the unit of [`FreeCurve::at`].
    pub at: Vec<f64>,
    /// One for each place.
    pub values: Vec<f64>,
}

/// An effect's values: one for each parameter, as a slice, the knots if it has a free curve in place of its formula, and the tables of
/// parameters. Parameters that the curve or a table replaces are at their neutral values.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    pub(super) parameters: Vec<f64>,
    pub(super) knots: Option<Knots>,
    /// In the order of the parameters.
    pub(super) tables: Vec<(usize, Table)>,
}

/// Greatest number of knots, and of places of a table.
pub const KNOTS_MAX: usize = 64;

impl Values {
    /// The knots in place of the formula; `None` if the effect has its formula.
    pub fn knots(&self) -> Option<&Knots> {
        self.knots.as_ref()
    }
}

impl Deref for Values {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.parameters
    }
}

impl Rises {
    /// The least value at a place after another with this value; `None` if it may be any.
    pub fn least(self, [before_at, at]: [f64; 2], before: f64) -> Option<f64> {
        match self {
            Self::No => None,
            Self::Value => Some(before),
            Self::ValueTimesPlace => Some(before * (before_at / at)),
        }
    }
}

impl Knots {
    /// Checks them against the curve of an effect.
    pub(super) fn check(&self, effect: &'static str, curve: &FreeCurve) -> Result<(), EffectError> {
        let FreeCurve { at, of, range: [least, most], rises, .. } = *curve;
        if self.at.len() != self.values.len() || !(1..=KNOTS_MAX).contains(&self.at.len()) {
            let [places, values] = [self.at.len(), self.values.len()];
            return Err(EffectError::KnotsNumber { effect, at, of, places, values });
        }
        let refuse = |key, index, value, want| Err(EffectError::Knot { effect, key, index, value, want });
        let mut before = 0.0;
        for (index, place) in self.at.iter().copied().enumerate() {
            if !(place > before && place.is_finite()) {
                return refuse(at, index, place, format!("finite and above {before}"));
            }
            before = place;
        }
        for (index, value) in self.values.iter().copied().enumerate() {
            if !(least..=most).contains(&value) {
                return refuse(of, index, value, format!("from {least} to {most}"));
            }
            let Some(before) = index.checked_sub(1) else { continue };
            let bound = rises.least([self.at[before], self.at[index]], self.values[before]);
            if let Some(bound) = bound.filter(|bound| value < *bound) {
                let what = if rises == Rises::Value { "it" } else { "it times the place" };
                return refuse(of, index, value, format!("at least {bound}, so that {what} does not fall"));
            }
        }
        Ok(())
    }

    /// The curve's value at a place.
    pub(super) fn line(&self, place: f64) -> f64 {
        self.between(place, |from, to| (place - from) / (to - from))
    }

    /// The same, over the logarithm of the place.
    pub(super) fn log_line(&self, place: f64) -> f64 {
        let share =
            |from: f64, to: f64| if from > 0.0 { (place / from).ln() / (to / from).ln() } else { place / to };
        self.between(place, share)
    }

    /// Weights at given places for parts at any: each part's weight is divided among its two neighbours on a `scale`.
    pub(super) fn divided(
        parts: impl IntoIterator<Item = (f64, f64)>,
        places: &[f64],
        scale: fn(f64) -> f64,
    ) -> Vec<f64> {
        let mut weights = vec![0.0; places.len()];
        for (place, weight) in parts {
            let next = places.partition_point(|at| *at <= place);
            let (low, high) = (next.saturating_sub(1), next.min(places.len() - 1));
            let share = if low < high && next > 0 {
                let [from, to] = [low, high].map(|index| scale(places[index]));
                (scale(place) - from) / (to - from)
            } else {
                0.0
            };
            weights[low] += (1.0 - share) * weight;
            weights[high] += share * weight;
        }
        weights
    }

    /// The value at a place; `share` is how far it is from one knot to the next, 0 to 1.
    fn between(&self, place: f64, share: impl Fn(f64, f64) -> f64) -> f64 {
        let next = self.at.partition_point(|at| *at <= place);
        let knot = |index: usize| Some((*self.at.get(index)?, *self.values.get(index)?));
        let before = next.checked_sub(1).and_then(knot);
        let (from, low) = before.unwrap_or_default();
        match knot(next) {
            Some((to, high)) => low + (high - low) * share(from, to),
            None => low,
        }
    }
}

#[cfg(test)]
#[path = "knots_tests.rs"]
mod tests;
