//! The form of each class: its formula, or knots where the data refute the formula.
//!
//! A name stands for a class, and its formula is one member. Each added effect that may have a free curve is fitted again with knots, which
//! start at the formula's own values. The knots stay if they gain more than their freedom would by chance:
//!
//! ```text
//! gain - freedom > 2 sqrt(2 freedom)          gain = (cost of the formula - cost of the knots) / variance
//! ```
//!
//! `variance` is that of slow sums of the noise. Noise alone gives a gain of `freedom`, with a standard deviation of `sqrt(2 freedom)`.
//! Besides, each half of the presses alone must show more than its part of the freedom, and the gain must exceed what a fit leaves undone.
//!
//! Only the fitted presses take part.

use std::collections::BTreeMap;

use super::grow::{POLISH_ROUNDS, Search, names};
use crate::data::DiscoverError;
use crate::fit::{Fitted, Parameters, Term, of_formulas, places, undone};

/// So many standard deviations of a gain by chance.
const REFUTED_Z: f64 = 2.0;

/// A model in which refuted formulas are replaced.
pub(crate) struct Formed {
    pub(crate) at: Fitted,
    pub(crate) refuted: Refuted,
}

impl From<Fitted> for Formed {
    fn from(at: Fitted) -> Self {
        Self { at, refuted: Refuted::new() }
    }
}

/// The refuted formula of each effect that has knots.
pub(crate) type Refuted = BTreeMap<&'static str, RefutedFormula>;

/// A formula that the data refute.
#[derive(Debug, Clone)]
pub(crate) struct RefutedFormula {
    /// Its values at the places of the knots.
    pub(crate) values: Vec<f64>,
    /// Root mean square of the held-out residuals with it, for the report alone.
    pub(crate) heldout_rms_counts: f64,
}

impl Search<'_> {
    /// A grown model, with knots in place of each added effect's formula that the data refute.
    pub(crate) fn formed(&self, grown: Fitted) -> Result<Formed, DiscoverError> {
        let mut formed = Formed::from(grown);
        for name in names(&formed.at.parameters, self.known_terms) {
            let Some(start) = self.with_knots(&formed.at, name) else { continue };
            (self.progress)(&format!("fitting {name} with knots"), 0.0);
            let values = start.knots.as_ref().map_or_else(Vec::new, |knots| knots.values.clone());
            let free = self.problem.fit_from(self.replaced(&formed.at, start), POLISH_ROUNDS)?;
            if self.refutes(&formed.at, &free) {
                let heldout_rms_counts = self.problem.heldout_rms_counts(&formed.at.predicted);
                formed.refuted.insert(name, RefutedFormula { values, heldout_rms_counts });
                formed.at = free;
            }
        }
        Ok(formed)
    }

    /// One term with knots for all added terms of a class; `None` if it has no curve, or no formula to refute.
    fn with_knots(&self, at: &Fitted, name: &str) -> Option<Term> {
        let added = || {
            let terms = at.parameters.terms.iter().skip(self.known_terms);
            terms.filter(|term| term.definition.name == name)
        };
        let first = added().next()?;
        let curve = first.curve()?;
        let knots = of_formulas(curve, added(), &places(curve, self.problem.predictor.frames));
        let acts = knots.values.iter().any(|value| *value != 0.0);
        acts.then(|| Term { knots: Some(knots), ..first.clone() })
    }

    /// A model with one term in place of all added terms of its class.
    fn replaced(&self, at: &Fitted, term: Term) -> Parameters {
        let mut replaced = at.parameters.clone();
        let is_class = |(index, of): (usize, &Term)| {
            index >= self.known_terms && of.definition.name == term.definition.name
        };
        let place = replaced.terms.iter().enumerate().position(is_class).unwrap_or(replaced.terms.len());
        let mut index = 0;
        replaced.terms.retain(|of| {
            index += 1;
            !is_class((index - 1, of))
        });
        replaced.terms.insert(place, term);
        replaced
    }

    /// True if a model with knots explains more than chance beyond one with formulas.
    fn refutes(&self, formula: &Fitted, free: &Fitted) -> bool {
        let numbers = |of: &Fitted| of.parameters.terms.iter().map(Term::numbers).sum::<usize>();
        let freedom = numbers(free).saturating_sub(numbers(formula)).max(1) as f64;
        let gain = formula.cost - free.cost;
        let chance = freedom + REFUTED_Z * (2.0 * freedom).sqrt();
        let undone = undone(formula.cost);
        if gain <= (chance * self.problem.variance).max(undone) {
            return false;
        }
        if formula.parameters.walk.is_some() {
            // A walk fits the noise of the blocks too.
            return true;
        }
        let halves = self.problem.fitted_halves(formula, free);
        halves.iter().all(|gain| *gain > 0.5 * freedom * self.problem.variance)
    }
}

#[cfg(test)]
#[path = "forms_tests.rs"]
mod tests;
