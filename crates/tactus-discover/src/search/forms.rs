//! The form of each class: its formula, or knots where the data refute the formula.
//!
//! A name stands for a class, and its formula is one member. Each added effect that may have a free curve is fitted again with knots, which
//! start at the formula's own values; one that was grown with knots is fitted again with the best formula. The knots stay if they gain more than their freedom would by chance:
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

use tactus_model::effect::{CurveKind, Knots};

use super::grow::{Equivalent, POLISH_ROUNDS, Search, names};
use crate::data::DiscoverError;
use crate::fit::{Fitted, Parameters, Term, of_formulas, places, undone};
use crate::progress::Stage;

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
#[derive(Debug, Clone, PartialEq)]
pub struct RefutedFormula {
    /// Its values at the places of the knots, the best of the formula.
    pub values: Vec<f64>,
    /// Root mean square of the held-out residuals with it, for the report alone.
    pub heldout_rms_counts: f64,
}

impl Search<'_> {
    /// A grown model, with knots in place of each added effect's formula that the data refute, and a formula in place of knots that it
    /// explains.
    pub(crate) fn formed(&self, grown: Fitted, equivalent: &Equivalent) -> Result<Formed, DiscoverError> {
        let mut formed = Formed::from(grown);
        self.reporter.enter(Stage::Forms, "fitting the names in other forms");
        for name in names(&formed.at.parameters, self.known_terms) {
            let has_knots = self.added(&formed.at, name).any(|term| term.knots.is_some());
            let formula = if has_knots {
                self.with_formula(&formed.at, name, equivalent)?
            } else {
                Some(formed.at.clone())
            };
            let Some(formula) = formula else { continue };
            let Some(knots) = self.as_knots(&formula, name) else { continue };
            let free = if has_knots { formed.at.clone() } else { self.with_knots(&formula, name, &knots)? };
            formed.at = if self.refutes(&formula, &free) {
                let heldout_rms_counts = self.problem.heldout_rms_counts(&formula.predicted);
                formed.refuted.insert(name, RefutedFormula { values: knots.values, heldout_rms_counts });
                free
            } else {
                formula
            };
        }
        Ok(formed)
    }

    /// Several formulas of a class whose curve is of weights, as one term with knots: they are fewer numbers, and all of them linear. Formulas
    /// stay apart if together they act the other way than weights can.
    pub(super) fn joined(&self, terms: Vec<Term>) -> Vec<Term> {
        let curve = terms.first().and_then(Term::curve).filter(|curve| curve.kind == CurveKind::Weights);
        let Some(curve) = curve.filter(|_| terms.len() > 1) else { return terms };
        let at = places(curve, self.problem);
        let together: f64 = terms.iter().flat_map(|term| (curve.formula)(&term.values, &at)).sum();
        if !(curve.range[0]..=curve.range[1]).contains(&together) {
            return terms;
        }
        vec![Term { knots: Some(of_formulas(curve, &terms, &at)), ..terms[0].clone() }]
    }

    /// The formula of a class as knots; `None` if it has no curve, or no formula to refute.
    pub(super) fn as_knots(&self, formula: &Fitted, name: &str) -> Option<Knots> {
        let curve = self.added(formula, name).find_map(Term::curve)?;
        let at = places(curve, self.problem);
        let knots = of_formulas(curve, self.added(formula, name), &at);
        knots.values.iter().any(|value| *value != 0.0).then_some(knots)
    }

    /// A model with knots, fitted, in place of all added terms of a class.
    pub(super) fn with_knots(&self, at: &Fitted, name: &str, knots: &Knots) -> Result<Fitted, DiscoverError> {
        self.reporter.tell(&format!("fitting {name} with knots"));
        let terms =
            self.added(at, name).take(1).map(|term| Term { knots: Some(knots.clone()), ..term.clone() });
        self.problem.fit_from(self.replaced(at, name, terms.collect()), POLISH_ROUNDS)
    }

    /// The added terms of a class.
    pub(crate) fn added<'a>(&self, at: &'a Fitted, name: &'a str) -> impl Iterator<Item = &'a Term> {
        let terms = at.parameters.terms.iter().skip(self.known_terms);
        terms.filter(move |term| term.definition.name == name)
    }

    /// A model with the best formula in place of all added terms of a class; `None` if no formula explains anything.
    fn with_formula(
        &self,
        at: &Fitted,
        name: &str,
        equivalent: &Equivalent,
    ) -> Result<Option<Fitted>, DiscoverError> {
        self.reporter.tell(&format!("fitting the formula of {name}"));
        let Some(alike) = equivalent.get(name) else { return Ok(None) };
        let Some(start) = self.formula_start(&*self.pass(&alike.without)?, name) else { return Ok(None) };
        self.problem.fit_from(self.replaced(at, name, vec![start]), POLISH_ROUNDS).map(Some)
    }

    /// A model with other terms in place of all added terms of a class.
    fn replaced(&self, at: &Fitted, name: &str, terms: Vec<Term>) -> Parameters {
        let mut replaced = at.parameters.clone();
        let is_class = |(index, of): (usize, &Term)| index >= self.known_terms && of.definition.name == name;
        let place = replaced.terms.iter().enumerate().position(is_class).unwrap_or(replaced.terms.len());
        let mut index = 0;
        replaced.terms.retain(|of| {
            index += 1;
            !is_class((index - 1, of))
        });
        replaced.terms.splice(place..place, terms);
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
