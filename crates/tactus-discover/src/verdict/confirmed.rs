//! The names of a grown model that presses confirm which their parameters have not seen.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use super::discovery::{AddedEffect, Estimated, FittedCurve, FittedKnot};
use crate::data::{DiscoverError, MISWIRED};
use crate::fit::{Fitted, FoldsOf, Prepared, Problem, Term, gains_by_folds};
use crate::progress::Stage;
use crate::search::{
    Equivalent, FLIPS, Formed, POLISH_ROUNDS, Partners, Refuted, RefutedFormula, Search, names, q_values,
    sign_flip_p, without,
};

/// An effect is confirmed if noise alone would let it gain as much, on fitted presses that its parameters have not seen, with at most this
/// probability.
const CONFIRMED_P: f64 = 0.05;
/// Few blocks cannot give so small a probability. They confirm if all agree: then it is the least that they can give, and otherwise at
/// least twice as much.
const AGREED: f64 = 1.5;
/// The parameter of a miswired element that names another one.
const ANSWERS_FOR: &str = "answers_for";

/// A grown model whose effects are confirmed.
pub(crate) struct Confirmed {
    pub(crate) grown: Fitted,
    /// Its added effects.
    pub(crate) steps: Vec<AddedEffect>,
    /// Those that are not confirmed.
    pub(crate) tentative: Vec<AddedEffect>,
    /// Those with which all blocks agree, too few as they are.
    agreed: Vec<&'static str>,
    /// The formulas that the data refute.
    refuted: Refuted,
}

/// An added effect, and whether presses that its parameters have not seen confirm it.
pub(crate) struct Step {
    added: AddedEffect,
    /// The least probability that flips of so few blocks can give.
    least_p: f64,
}

impl Step {
    fn is_confirmed(&self) -> bool {
        // What folds cannot tell is confirmed by its odds alone.
        self.added.folds_p_value.is_none_or(|p_value| p_value <= CONFIRMED_P.max(AGREED * self.least_p))
    }
}

/// A model with those of its added effects that folds of the fitted presses confirm. The held-out presses have no say.
pub(crate) fn confirmed(
    prepared: &Prepared<'_>,
    search: &Search<'_>,
    formed: Formed,
    equivalent: &Equivalent,
) -> Result<Confirmed, DiscoverError> {
    let Formed { at: grown, refuted } = formed;
    let names = names(&grown.parameters, search.known_terms);
    search.reporter.enter(Stage::Confirming, "confirming the names on folds of presses");
    let steps = search.steps(&grown, equivalent, &refuted, &prepared.problem_with_silent())?;
    // A miswired element acts on its own readings, of which a fold may have none.
    let is_firm = |step: &Step| {
        !names.contains(&step.added.effect) || step.added.effect == MISWIRED || step.is_confirmed()
    };
    let (steps, tentative): (Vec<Step>, Vec<Step>) = steps.into_iter().partition(is_firm);
    let few = |step: &&Step| {
        names.contains(&step.added.effect)
            && step.added.folds_p_value.is_some_and(|p_value| p_value > CONFIRMED_P)
    };
    let agreed = steps.iter().filter(few).map(|step| step.added.effect).collect();
    let all = Confirmed { grown, steps: added(steps), tentative: Vec::new(), agreed, refuted };
    if tentative.is_empty() {
        return Ok(all);
    }
    let tentative = added(tentative);
    let gone: Vec<&str> = tentative.iter().map(|step| step.effect).collect();
    Ok(Confirmed { tentative, ..all.without(&gone, prepared, search, equivalent)? })
}

fn added(steps: Vec<Step>) -> Vec<AddedEffect> {
    steps.into_iter().map(|step| step.added).collect()
}

impl Confirmed {
    /// The model without some of its names, fitted again.
    pub(super) fn without(
        &self,
        gone: &[&str],
        prepared: &Prepared<'_>,
        search: &Search<'_>,
        equivalent: &Equivalent,
    ) -> Result<Self, DiscoverError> {
        let less = without(&self.grown.parameters, gone, search.known_terms);
        let grown = if prepared.base.parameters.has_terms_like(&less) {
            prepared.base.clone()
        } else {
            search.problem.fit_from(less, POLISH_ROUNDS)?
        };
        let steps = search.steps(&grown, equivalent, &self.refuted, &prepared.problem_with_silent())?;
        Ok(Self {
            grown,
            steps: added(steps),
            tentative: self.tentative.clone(),
            agreed: self.agreed.iter().copied().filter(|name| !gone.contains(name)).collect(),
            refuted: self.refuted.clone(),
        })
    }

    /// A warning if effects are confirmed by all of too few blocks.
    pub(super) fn few_presses(&self) -> Option<String> {
        let names = self.agreed.join(" and ");
        (!self.agreed.is_empty()).then(|| {
            format!(
                "the presses are few: all their independent blocks agree with {names}, but they are too few for \
                 a probability of {CONFIRMED_P}; five presses or more, at several places, would tell"
            )
        })
    }
}

impl Search<'_> {
    /// The added effects, those of faulty elements included, each name once. `with_silent` is the problem in which dead and stuck elements
    /// have a weight.
    pub(crate) fn steps(
        &self,
        grown: &Fitted,
        equivalent: &Equivalent,
        refuted: &Refuted,
        with_silent: &Problem<'_>,
    ) -> Result<Vec<Step>, DiscoverError> {
        let known_terms = self.problem.predictor.known.effects.len();
        let names = names(&grown.parameters, known_terms);
        let mut of_grown: BTreeMap<FoldsOf, Option<Vec<f64>>> = BTreeMap::new();
        let mut steps = Vec::new();
        for name in names {
            let problem = if name == MISWIRED { with_silent } else { self.problem };
            let less = without(&grown.parameters, &[name], known_terms);
            let held = equivalent.get(name).map(|alike| &alike.without);
            let before = match held.filter(|held| held.parameters.has_terms_like(&less)) {
                Some(held) => held.clone(),
                None => problem.fit_from(less, POLISH_ROUNDS)?,
            };
            let gains = problem.heldout_gains(&before.predicted, &grown.predicted);
            let partners = (name == MISWIRED).then(|| Partners::of(problem, &before));
            let terms = grown.parameters.terms.iter().zip(&grown.errors).skip(known_terms);
            let estimated = |(term, errors): (&Term, &Vec<f64>)| {
                term.definition
                    .parameters
                    .iter()
                    .zip(&term.values)
                    .zip(errors)
                    .enumerate()
                    .filter(|(parameter, ((known, value), _))| {
                        let is_untold = |partners| !is_told(partners, term);
                        if known.name == ANSWERS_FOR && partners.as_ref().is_some_and(is_untold) {
                            return false;
                        }
                        // Beside a table, the others stay neutral.
                        term.acts(*parameter)
                            && (term.tables.is_empty() || value.to_bits() != known.neutral.to_bits())
                    })
                    .map(|(_, ((known, value), error))| Estimated {
                        name: known.name,
                        value: *value,
                        // An error greater than the range means that the data do not determine it.
                        standard_error: Some(*error).filter(|error| *error <= problem.scale_of(known).reach),
                    })
                    .collect()
            };
            let curves = fitted_curves(grown, known_terms, name, refuted.get(name));
            let p_value = sign_flip_p(&gains, FLIPS, self.options.seed);
            let folds = self.added(grown, name).next().map_or(FoldsOf::Presses, FoldsOf::effect);
            let of_grown = match of_grown.entry(folds) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(unknown) => unknown.insert(self.problem.left_by_folds(grown, folds)?),
            };
            let of_less = self.problem.left_by_folds(&before, folds)?;
            let by_folds = of_less.zip(of_grown.as_ref()).map(|(less, grown)| gains_by_folds(&less, grown));
            let blocks = by_folds.iter().flatten().filter(|gain| **gain != 0.0).count();
            let least_p = 0.5_f64.powf(blocks as f64);
            let added = AddedEffect {
                effect: name,
                terms: terms.filter(|(term, _)| term.definition.name == name).map(estimated).collect(),
                p_value,
                q_value: p_value,
                folds_p_value: by_folds.map(|gains| sign_flip_p(&gains, FLIPS, self.options.seed)),
                heldout_rms_before_counts: problem.heldout_rms_counts(&before.predicted),
                heldout_rms_after_counts: problem.heldout_rms_counts(&grown.predicted),
                curves,
                equivalent: equivalent
                    .get(name)
                    .into_iter()
                    .flat_map(|alike| alike.same.iter().map(|(rival, _)| *rival))
                    .collect(),
            };
            steps.push(Step { added, least_p });
        }
        let p_values: Vec<f64> = steps.iter().map(|step| step.added.p_value).collect();
        for (step, q_value) in steps.iter_mut().zip(q_values(&p_values)) {
            step.added.q_value = q_value;
        }
        Ok(steps)
    }
}

/// True if the data tell for which other element a miswired one answers.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "numbers of elements")]
fn is_told(partners: &Partners, miswired: &Term) -> bool {
    let of = |name: &str| {
        let at = miswired.definition.parameters.iter().position(|parameter| parameter.name == name)?;
        miswired.values.get(at).map(|index| *index as usize)
    };
    of("element").zip(of(ANSWERS_FOR)).is_none_or(|(element, other)| partners.tell(element, other))
}

/// The free curves and the tables of an added effect, beside the formula that the data refute.
fn fitted_curves(
    grown: &Fitted,
    known_terms: usize,
    name: &str,
    refuted: Option<&RefutedFormula>,
) -> Vec<FittedCurve> {
    let terms = grown.parameters.terms.iter().zip(&grown.errors).skip(known_terms);
    let mut curves = Vec::new();
    for (term, errors) in terms.filter(|(term, _)| term.definition.name == name) {
        let mut errors = errors.iter().skip(term.values.len());
        let mut knots = |at: &[f64], values: &[f64]| -> Vec<FittedKnot> {
            let knot = |((at, value), error): ((&f64, &f64), &f64)| FittedKnot {
                at: *at,
                value: *value,
                standard_error: Some(*error).filter(|error| error.is_finite()),
            };
            at.iter().zip(values).zip(errors.by_ref()).map(knot).collect()
        };
        if let Some((curve, of)) = term.curve().zip(term.knots.as_ref()) {
            curves.push(FittedCurve {
                at: curve.at,
                of: curve.of,
                knots: knots(&of.at, &of.values),
                formula: refuted.cloned(),
            });
        }
        for (parameter, table) in &term.tables {
            curves.push(FittedCurve {
                at: table.by.name(),
                of: term.definition.parameters[*parameter].name,
                knots: knots(&table.at, &table.values),
                formula: None,
            });
        }
    }
    curves
}

#[cfg(test)]
#[path = "confirmed_tests.rs"]
mod tests;
