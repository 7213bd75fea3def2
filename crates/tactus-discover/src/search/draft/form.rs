//! The form of a draft: knots, weights, a second covariate and a law, each as far as the data show it.
//!
//! An atom that won has a coarse curve: enough to tell what acts on what. Here its curve gets as many knots as the evidence carries, its elements get
//! weights, and a second covariate comes beside the first, where that gains more than a form may miss, and holds for presses that had no part in it, taken together. The curve becomes a law if one
//! passes through it as nearly. Then the draft is fitted as an effect, which moves all else, and its curve is made once more where the others are
//! then: what a model without the draft predicts is what it acts on, and until then that had taken up a part of it.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use tactus_model::effect::{Carrier, Draft};

use super::curves::Curve;
use super::grammar::Atom;
use super::sight::Sight;
use super::{KNOTS, KNOTS_OF_SECOND, Unseen, additions, as_good_as_first, curves, grammar, words};
use crate::data::DiscoverError;
use crate::fit::{FOLDS, Fitted, Grams, Term};
use crate::search::evidence::Addition;
use crate::search::grow::{POLISH_ROUNDS, Search};

/// What the form of a draft may miss, as a share of what the draft explains: a curve is to be within 10 % (rms) of the physics, which is a
/// hundredth of the squares, and three choices of form share it (weights, a second covariate, a law).
const MISSED_SHARE: f64 = 0.01 / 3.0;
/// The least that one more part of a form must gain, as the logarithm of its odds.
const MISSED_LN_ODDS: f64 = 5.0;
/// Numbers of knots among which the evidence chooses, as multiples of those of the grammar.
const FINER: [usize; 2] = [2, 4];
const FINER_OF_SECOND: usize = 2;

/// A draft as an effect, fitted.
#[derive(Clone)]
pub(super) struct AsEffect {
    pub(super) draft: Draft,
    pub(super) at: Fitted,
    pub(super) covariance: Vec<Vec<f64>>,
    pub(super) knots: Vec<[f64; 3]>,
}

/// Something that a form gains, as the logarithm of its odds.
type Gained<T> = Option<(f64, T)>;

impl Search<'_> {
    /// An atom, which was the best of so many, as an effect, and by how much it is nearer to presses that its numbers have not seen, block by block;
    /// `None` if it gains nothing.
    pub(super) fn as_effect(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atom: Atom,
        among: f64,
        name: &str,
    ) -> Result<Unseen, DiscoverError> {
        let atom = self.with_form(at, sight, atom, among)?;
        let Some(first) = self.in_form(at, sight, &atom, name, at.cost)? else { return Ok(None) };
        // Beside the model without it as that was fitted.
        let unseen_gains = self.unseen_gains_of(at, sight, &atom)?;
        let without = self.without_last(&first.at)?;
        let sight = Arc::new(Sight::of(self.problem, &without)?);
        let atom = grammar::picked_anew(atom, self.problem, &without, &sight);
        let again = self.in_form(&without, &sight, &atom, name, first.at.cost)?;
        Ok(Some((again.unwrap_or(first), unseen_gains)))
    }

    /// The atom with the knots, the weights and the second covariate that the data show.
    fn with_form(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atom: Atom,
        among: f64,
    ) -> Result<Atom, DiscoverError> {
        if atom.of_elements {
            let coarse = self.with_weights(at, sight, atom)?;
            let fine = self.with_best_knots(at, sight, &finer(&coarse, sight))?;
            let Some(shared) = self.curve(at, sight, &fine)?.shared() else { return Ok(coarse) };
            return self.with_weights(at, sight, Atom { of_elements: true, curve: Some(shared), ..fine });
        }
        let fine = self.with_best_knots(at, sight, &finer(&atom, sight))?;
        let weights = self.weights_beside(at, sight, &fine)?;
        let second = self.second_beside(at, sight, &fine, &atom, among)?;
        let weighted = |atom: Atom, weights| Atom { weights: Some(weights), ..atom };
        match (weights, second) {
            (None, None) => Ok(fine),
            (Some((_, weights)), None) => Ok(weighted(fine, weights)),
            (None, Some((_, both))) => self.with_best_knots(at, sight, &finer_of_both(&both, fine, sight)),
            (Some((by_weights, weights)), Some((by_second, _))) if by_weights >= by_second => {
                let (fine, coarse) = (weighted(fine, Arc::clone(&weights)), weighted(atom, weights));
                match self.second_beside(at, sight, &fine, &coarse, among)? {
                    Some((_, both)) => self.with_best_knots(at, sight, &finer_of_both(&both, fine, sight)),
                    None => Ok(fine),
                }
            }
            (Some(_), Some((_, both))) => {
                let both = self.with_best_knots(at, sight, &finer_of_both(&both, fine, sight))?;
                Ok(match self.weights_beside(at, sight, &both)? {
                    Some((_, weights)) => weighted(both, weights),
                    None => both,
                })
            }
        }
    }

    /// Of forms of one atom the one that the data prefer, and of those that are as good the one with the fewest numbers.
    fn with_best_knots(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atoms: &[Atom],
    ) -> Result<Atom, DiscoverError> {
        if let [only] = atoms {
            return Ok(only.clone());
        }
        let ranked = self.ranked(at, sight, atoms, 1.0)?;
        let as_good = as_good_as_first(&ranked).into_iter().map(|(place, _)| &atoms[place]);
        Ok(as_good.min_by_key(|atom| atom.columns(sight.elements)).unwrap_or(&atoms[0]).clone())
    }

    /// The atom with a second covariate and what that gains beside the fine curve of the first one, if it is more than a form may miss.
    fn second_beside(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        fine: &Atom,
        coarse: &Atom,
        among: f64,
    ) -> Result<Gained<Atom>, DiscoverError> {
        let seconds: Vec<Atom> = grammar::with_seconds(coarse, sight).collect();
        let each = seconds.iter().map(|second| second.columns(sight.elements)).max().unwrap_or(1);
        let room = self.columns_most().saturating_sub(fine.columns(sight.elements));
        let mut best: Gained<Atom> = None;
        for some in seconds.chunks((room / each).max(1)) {
            let atoms = std::iter::once(fine).chain(some).cloned().collect();
            let (weighed, grams) = self.products(at, sight, atoms)?;
            let additions = additions(&weighed, &grams, among * seconds.len() as f64);
            let evidence = self.evidence_of(&additions, grams.reduced());
            let first = evidence.set([0]);
            let least = best.as_ref().map_or(missed(first.ln_odds), |(gain, _)| *gain);
            let gain = |second: usize| (evidence.gain(&first, second).ln_odds, second);
            let mut gains: Vec<(f64, usize)> = (1..weighed.len()).map(gain).collect();
            gains.retain(|(gain, _)| *gain > least);
            gains.sort_by(|a, b| b.0.total_cmp(&a.0));
            let held = gains.into_iter().find(|(_, second)| self.holds(&grams, &additions, [0, *second]));
            best = held.map(|(gain, second)| (gain, weighed[second].atom.clone())).or(best);
        }
        Ok(best)
    }

    /// Weights of the elements for an atom that acts on all alike, and what they gain, if that is more than a form may miss.
    fn weights_beside(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atom: &Atom,
    ) -> Result<Gained<Arc<Vec<f64>>>, DiscoverError> {
        let may_have = matches!(atom.carrier, Carrier::Counts | Carrier::OwnSignal | Carrier::EveryElement);
        let is_too_many = sight.elements + atom.columns(sight.elements) > self.columns_most();
        if !may_have || atom.weights.is_some() || is_too_many {
            return Ok(None);
        }
        let Some(shared) = self.curve(at, sight, atom)?.shared() else { return Ok(None) };
        let beside = Atom { of_elements: true, curve: Some(shared), ..atom.clone() };
        let (weighed, grams) = self.products(at, sight, vec![atom.clone(), beside])?;
        let additions = additions(&weighed, &grams, 1.0);
        let evidence = self.evidence_of(&additions, grams.reduced());
        let common = evidence.set([0]);
        let gain = evidence.gain(&common, 1).ln_odds;
        if gain <= missed(common.ln_odds) || !self.holds(&grams, &additions, [0, 1]) {
            return Ok(None);
        }
        let found: BTreeMap<usize, f64> = evidence.coefficients(&evidence.set([0, 1])).into_iter().collect();
        let value = |one: &usize| found.get(one).copied().unwrap_or(0.0);
        let of_common = weighed[0].directions.iter().map(value);
        let most = of_common.fold(f64::MIN_POSITIVE, |most: f64, one| most.max(one.abs()));
        let weights = weighed[1].directions.iter().map(|one| 1.0 + value(one) / most).collect();
        Ok(Some((gain, Arc::new(weights))))
    }

    /// An atom of single elements with the weight of each; the largest is 1.
    fn with_weights(&self, at: &Fitted, sight: &Arc<Sight>, atom: Atom) -> Result<Atom, DiscoverError> {
        let atom = Atom { weights: None, ..atom };
        let weights = self.curve(at, sight, &atom)?.values;
        let most = weights.amax().max(f64::MIN_POSITIVE);
        let weights = Arc::new(weights.iter().map(|one| one / most).collect());
        Ok(Atom { weights: Some(weights), of_elements: false, curve: None, ..atom })
    }

    /// The coefficients of an atom's columns with the greatest posterior probability.
    fn curve(&self, at: &Fitted, sight: &Arc<Sight>, atom: &Atom) -> Result<Curve, DiscoverError> {
        let (additions, grams) = self.alone(at, sight, atom)?;
        Ok(self.curve_of(&additions, &grams))
    }

    fn curve_of(&self, additions: &[Addition], grams: &Grams) -> Curve {
        let evidence = self.evidence_of(additions, grams.reduced());
        let set = evidence.set([0]);
        let found: BTreeMap<usize, f64> = evidence.coefficients(&set).into_iter().collect();
        let directions = &additions[0].directions;
        let value = |one: &usize| found.get(one).copied().unwrap_or(0.0);
        let product = |i: usize, j: usize| grams.reduced()[(directions[i], directions[j])];
        Curve {
            values: DVector::from_iterator(directions.len(), directions.iter().map(value)),
            gram: DMatrix::from_fn(directions.len(), directions.len(), product) / self.problem.variance,
            determined: evidence.determined(&set),
        }
    }

    /// An atom as the only addition, with its products.
    fn alone(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atom: &Atom,
    ) -> Result<(Vec<Addition>, Grams), DiscoverError> {
        let (weighed, grams) = self.products(at, sight, vec![atom.clone()])?;
        Ok((additions(&weighed, &grams, 1.0), grams))
    }

    /// By how much an atom that is fitted to the other folds is nearer to the presses of each, block by block. Of an atom with weights either its curve is
    /// fitted or they are, whichever gains less: what was found with all presses gains something in any noise.
    fn unseen_gains_of(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atom: &Atom,
    ) -> Result<Vec<f64>, DiscoverError> {
        let (additions, grams) = self.alone(at, sight, atom)?;
        let by_curve = self.unseen_gains(&grams, &additions, &[0]);
        let weighted = atom.weights.as_ref().and_then(|_| self.curve_of(&additions, &grams).shared());
        let Some(shared) = weighted else { return Ok(by_curve) };
        let of_elements = Atom { weights: None, of_elements: true, curve: Some(shared), ..atom.clone() };
        let (additions, grams) = self.alone(at, sight, &of_elements)?;
        let by_weights = self.unseen_gains(&grams, &additions, &[0]);
        let whole = |gains: &[f64]| gains.iter().sum::<f64>();
        Ok(if whole(&by_weights) < whole(&by_curve) { by_weights } else { by_curve })
    }

    /// By how much additions that are fitted to the other folds are nearer to the presses of each, block by block.
    fn unseen_gains(&self, grams: &Grams, additions: &[Addition], members: &[usize]) -> Vec<f64> {
        let of_others = |fold: usize| -> Vec<(usize, f64)> {
            let products = grams.without(fold);
            let evidence = self.evidence_of(additions, &products);
            evidence.coefficients(&evidence.set(members.iter().copied()))
        };
        let by_folds: Vec<Vec<(usize, f64)>> = (0..FOLDS).map(of_others).collect();
        grams.gains(|fold| &by_folds[fold])
    }

    /// True if one more part of a form comes nearer to presses that it has not seen than the form without it.
    fn holds(&self, grams: &Grams, additions: &[Addition], [form, part]: [usize; 2]) -> bool {
        let unseen = |members: &[usize]| self.unseen_gains(grams, additions, members).iter().sum::<f64>();
        unseen(&[form, part]) > unseen(&[form])
    }

    /// The atom's curve, as a law or a table, fitted as an effect; `None` if it does not come nearer to the data than this cost.
    fn in_form(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atom: &Atom,
        name: &str,
        cost: f64,
    ) -> Result<Option<AsEffect>, DiscoverError> {
        let curve = self.curve(at, sight, atom)?;
        let reduced = curves::reduced(atom, &curve, missed(0.5 * curve.squares()));
        let draft = words::named(sight, atom, reduced.law, name);
        Ok(self.taken(at, draft, cost)?.map(|(draft, fitted, by)| AsEffect {
            draft,
            at: fitted,
            covariance: scaled(reduced.covariance, by * by),
            knots: reduced.knots.into_iter().map(|[at, value, error]| [at, by * value, by * error]).collect(),
        }))
    }

    /// The draft as a term of the model, with its law as it is fitted, so that its strength is 1; `None` if it does not come nearer to the data
    /// than this cost.
    fn taken(
        &self,
        at: &Fitted,
        draft: Draft,
        cost: f64,
    ) -> Result<Option<(Draft, Fitted, f64)>, DiscoverError> {
        let term = Term::of_draft(draft.clone().define()?);
        let fitted = self.problem.fit_from(at.parameters.with(term), POLISH_ROUNDS)?;
        let [along, quadrature] = fitted.parameters.terms.last().map_or([0.0; 2], Term::strength_of_draft);
        let strength = along.hypot(quadrature);
        if along <= 0.0 || fitted.cost >= cost {
            return Ok(None);
        }
        let draft = Draft { law: draft.law.turned([along, quadrature]), ..draft };
        let draft = Draft { sentence: words::sentence(&draft), ..draft };
        // The prediction is the same: a draft is its strength times its law.
        let mut parameters = fitted.parameters;
        if let Some(last) = parameters.terms.last_mut() {
            *last = Term::of_draft(draft.clone().define()?);
        }
        let mut errors = fitted.errors;
        errors.last_mut().into_iter().flatten().for_each(|error| *error /= strength);
        Ok(Some((draft, Fitted { parameters, errors, ..fitted }, strength)))
    }

    /// A model as it is fitted, without its last term.
    fn without_last(&self, with: &Fitted) -> Result<Fitted, DiscoverError> {
        let mut parameters = with.parameters.clone();
        parameters.terms.pop();
        let predicted = self.problem.predict(&parameters)?;
        let (cost, errors) = (self.problem.cost(&predicted), with.errors[..parameters.terms.len()].to_vec());
        Ok(Fitted { parameters, predicted, cost, errors })
    }
}

/// The atom, and with more knots, as far as the readings have places for them.
pub(super) fn finer(atom: &Atom, sight: &Sight) -> Vec<Atom> {
    let mut atoms = vec![atom.clone()];
    // A jump has its place, and a curve that the elements share its knots.
    let is_fixed = atom.is_jump || atom.curve.is_some();
    if let ([places], [covariate], false) = (atom.knots.as_slice(), atom.covariates.as_slice(), is_fixed)
        && places.len() > 1
    {
        for times in FINER {
            let knots = sight.knots((atom.carrier, atom.when, *covariate), times * KNOTS);
            if atoms.iter().all(|known| known.knots[0].len() < knots.len()) {
                atoms.push(Atom { knots: vec![knots], ..atom.clone() });
            }
        }
    }
    atoms
}

/// An atom of one covariate, and with a second one: with the knots of the grammar, with more of either, and of both.
fn finer_of_both(both: &Atom, fine: Atom, sight: &Sight) -> Vec<Atom> {
    let more =
        |place: usize, count: usize| sight.knots((both.carrier, both.when, both.covariates[place]), count);
    let [first, second] = [more(0, FINER[0] * KNOTS), more(1, FINER_OF_SECOND * KNOTS_OF_SECOND)];
    let mut atoms = vec![fine];
    for first in [&both.knots[0], &first] {
        for second in [&both.knots[1], &second] {
            atoms.push(Atom { knots: vec![first.clone(), second.clone()], ..both.clone() });
        }
    }
    atoms
}

/// What a form may miss of what a draft explains: both are logarithms of odds, or of likelihoods.
fn missed(explained: f64) -> f64 {
    MISSED_LN_ODDS.max(MISSED_SHARE * explained)
}

/// Rows times a factor.
fn scaled(rows: Vec<Vec<f64>>, by: f64) -> Vec<Vec<f64>> {
    rows.into_iter().map(|row| row.into_iter().map(|value| by * value).collect()).collect()
}

#[cfg(test)]
#[path = "form_tests.rs"]
mod tests;
