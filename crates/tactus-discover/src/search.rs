//! The search: which effects, together with the base parameters, make of the residual noise.
//!
//! Forward: every effect of the library is scored at the residual of the model so far; those that the residual wants most
//! are fitted jointly with all that is in the model, and the one that lessens the cost of the fitted presses most is
//! taken. An effect may be taken again: physics rarely has the very form of the library, and a second term of one effect
//! is a simpler explanation than another effect. Back: each effect must earn its place against the model without it, and
//! against every other effect in its place.

use tactus_model::effect::Definition;

use crate::candidates::{Candidate, Screened, with};
use crate::discovery;
use crate::fit::{Fitted, Problem};
use crate::parallel;
use crate::score::{Fitting, Score, flipped, p_value};
use crate::sensor::{Parameters, Term};
use crate::{DiscoverError, Options};

/// Sign-flipped data sets of a test.
const FLIPS: usize = 1999;
/// Chance of adding anything to a model that lacks nothing.
pub(crate) const ALPHA: f64 = 0.01;
/// So many candidates of a round are fitted.
const FITTED_MAX: usize = 8;
/// Terms that a model may gain.
const TERMS_MAX: usize = 7;
/// Different effects that a model may gain.
const NAMES_MAX: usize = 4;
/// A term of an effect that is in the model already is taken before another effect that lessens the gap by no more than
/// this much better.
const AGAIN_SHARE: f64 = 0.5;
/// Rounds of a fit that compares candidates.
const TRIAL_ROUNDS: usize = 7;
/// Without it the gap on held-out presses must be so many times as large, for an effect to stay.
const EARNS: f64 = 1.6;

/// The search's tools.
pub(crate) struct Search<'a> {
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) candidates: &'a [Candidate],
    pub(crate) options: Options,
    /// Terms that were known before and stay.
    pub(crate) known_terms: usize,
    /// How far the base model is from the held-out presses.
    pub(crate) base_gap: f64,
    pub(crate) progress: &'a (dyn Fn(&str) + Sync),
}

/// A round: what was tried, and what came of it.
pub(crate) struct Tried {
    pub(crate) round: discovery::Round,
    /// Fits that were made, best first.
    pub(crate) fits: Vec<(&'static str, Fitted)>,
    /// Chance of so large a score of any candidate if nothing were missing.
    pub(crate) p_value: f64,
}

impl Search<'_> {
    /// Scores of all candidates at a model.
    pub(crate) fn screen(&self, fitting: &Fitting<'_>, at: &Fitted) -> Result<Vec<Screened>, DiscoverError> {
        let screen =
            |candidate: &Candidate| candidate.screen(fitting, self.problem, &at.parameters, &at.predicted);
        parallel::map(self.candidates, self.options.threads, screen).into_iter().collect()
    }

    /// Adds what the residual wants, until it wants nothing.
    pub(crate) fn forward(&self, mut at: Fitted) -> Result<(Fitted, Vec<Tried>), DiscoverError> {
        let mut rounds = Vec::new();
        loop {
            let tried = self.round(&at, rounds.len())?;
            let (taken, fitted) = match self.take(&at, &tried) {
                Some(taken) => taken,
                None => {
                    rounds.push(tried);
                    break;
                }
            };
            (self.progress)(&format!("round {}: adding {taken}", rounds.len() + 1));
            let mut tried = tried;
            tried.round.taken = Some(taken);
            rounds.push(tried);
            at = self.problem.fit_from(fitted.parameters, 8, &[], self.options.threads)?;
            if at.parameters.terms.len() - self.known_terms >= TERMS_MAX {
                break;
            }
        }
        Ok((at, rounds))
    }

    /// Scores every candidate and fits those that are wanted.
    pub(crate) fn round(&self, at: &Fitted, index: usize) -> Result<Tried, DiscoverError> {
        (self.progress)(&format!("round {}: scoring the effects", index + 1));
        let fitting = self.fitting(at)?;
        let screened = self.screen(&fitting, at)?;
        let groups: Vec<Vec<&Score>> = screened.iter().map(|one| one.scores.iter().collect()).collect();
        let under_none = flipped(&groups, FLIPS, self.options.seed ^ (index as u64 + 1));
        let largest = largest(&under_none);
        let statistic = |one: &Screened| one.scores.iter().map(|score| score.z).fold(0.0, f64::max);
        let mut tried: Vec<discovery::Candidate> = screened
            .iter()
            .map(|one| discovery::Candidate {
                effect: one.definition.name,
                score: statistic(one),
                p_value: p_value(statistic(one), &largest),
                heldout_rms_counts: None,
                shrink: None,
            })
            .collect();
        let p_value = tried.iter().map(|one| one.p_value).fold(1.0, f64::min);
        let mut order: Vec<usize> = (0..screened.len()).collect();
        order.sort_by(|a, b| screened[*b].promise.total_cmp(&screened[*a].promise));
        let wanted = 2.0 * p_value <= ALPHA;
        order.retain(|one| wanted && screened[*one].promise > self.penalty());
        let best = order.first().map_or(0.0, |one| screened[*one].promise);
        order.retain(|one| screened[*one].promise > 0.05 * best);
        order.truncate(FITTED_MAX);
        let starts: Vec<Term> = order.iter().map(|one| screened[*one].start.clone()).collect();
        let mut fits = self.fits(at, &starts)?;
        fits.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        for (name, fitted) in &fits {
            if let Some(one) = tried.iter_mut().find(|one| one.effect == *name) {
                let share =
                    self.problem.heldout_gap(&fitted.predicted).value / self.base_gap.max(f64::MIN_POSITIVE);
                one.shrink = (self.base_gap > 0.0).then_some(1.0 - share);
                one.heldout_rms_counts = Some(self.problem.heldout_rms_counts(&fitted.predicted));
            }
        }
        let place = |name: &str| fits.iter().position(|(fitted, _)| *fitted == name).unwrap_or(usize::MAX);
        tried.sort_by(|a, b| place(a.effect).cmp(&place(b.effect)).then(b.score.total_cmp(&a.score)));
        let names = names(&at.parameters, self.known_terms);
        Ok(Tried { round: discovery::Round { with: names, candidates: tried, taken: None }, fits, p_value })
    }

    /// Fits of a model with each of the terms.
    pub(crate) fn fits(
        &self,
        at: &Fitted,
        starts: &[Term],
    ) -> Result<Vec<(&'static str, Fitted)>, DiscoverError> {
        let fit = |start: &Term| {
            (self.progress)(&format!("fitting {}", start.definition.name));
            let started = with(&at.parameters, start.clone());
            let fitted = self.problem.fit_from(started, TRIAL_ROUNDS, &[], 1)?;
            Ok((start.definition.name, fitted))
        };
        parallel::map(starts, self.options.threads, fit).into_iter().collect()
    }

    /// The model's tangent space and residual.
    pub(crate) fn fitting(&self, at: &Fitted) -> Result<Fitting<'_>, DiscoverError> {
        let problem = self.problem;
        let linear = problem.linear(&at.parameters, &at.predicted)?;
        let columns = problem.columns(&at.parameters, &at.predicted, self.options.threads)?;
        Ok(Fitting::new(problem, linear, columns, &at.predicted))
    }

    fn take(&self, at: &Fitted, tried: &Tried) -> Option<(&'static str, Fitted)> {
        let names = names(&at.parameters, self.known_terms);
        let allowed = |name: &&'static str| names.contains(name) || names.len() < NAMES_MAX;
        let (best_name, best) = tried.fits.iter().find(|(name, _)| allowed(name))?;
        let gain = at.cost - best.cost;
        if gain <= self.penalty() {
            return None;
        }
        let again = tried
            .fits
            .iter()
            .find(|(name, fitted)| names.contains(name) && at.cost - fitted.cost > AGAIN_SHARE * gain);
        let (name, fitted) = again.map_or((best_name, best), |(name, fitted)| (name, fitted));
        Some((name, fitted.clone()))
    }

    /// What a term must lessen the cost by at least.
    fn penalty(&self) -> f64 {
        10.0
    }

    /// Takes back what does not earn its place, and puts in its place what serves better.
    pub(crate) fn back(&self, mut at: Fitted) -> Result<Fitted, DiscoverError> {
        loop {
            let names = names(&at.parameters, self.known_terms);
            if names.is_empty() {
                return Ok(at);
            }
            let without = |name: &&'static str| {
                (self.progress)(&format!("without {name}"));
                self.problem.fit_from(without(&at.parameters, name, self.known_terms), TRIAL_ROUNDS, &[], 1)
            };
            let fits: Vec<Fitted> =
                parallel::map(&names, self.options.threads, without).into_iter().collect::<Result<_, _>>()?;
            let here = self.problem.heldout_gap(&at.predicted);
            let ratios = fits
                .iter()
                .map(|fitted| self.problem.heldout_gap(&fitted.predicted).value / here.value.max(here.error));
            let Some((least, ratio)) = ratios.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) else {
                return Ok(at);
            };
            if ratio >= EARNS {
                return Ok(at);
            }
            let Some(simpler) = fits.into_iter().nth(least) else { return Ok(at) };
            at = self.problem.fit_from(simpler.parameters, 8, &[], self.options.threads)?;
        }
    }
}

/// The effects that were added, each once, in order.
pub(crate) fn names(parameters: &Parameters, known_terms: usize) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = Vec::new();
    for Term { definition, .. } in parameters.terms.iter().skip(known_terms) {
        let Definition { name, .. } = definition;
        if !names.contains(name) {
            names.push(name);
        }
    }
    names
}

/// A model without the terms of an effect that were added.
pub(crate) fn without(parameters: &Parameters, name: &str, known_terms: usize) -> Parameters {
    let mut less = parameters.clone();
    let mut index = 0;
    less.terms.retain(|term| {
        index += 1;
        index <= known_terms || term.definition.name != name
    });
    less
}

/// The largest of all groups in each flipped data set.
pub(crate) fn largest(groups: &[Vec<f64>]) -> Vec<f64> {
    let flips = groups.first().map_or(0, Vec::len);
    (0..flips).map(|flip| groups.iter().map(|group| group[flip]).fold(0.0, f64::max)).collect()
}
