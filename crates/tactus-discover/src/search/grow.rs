//! The search for the effects that, together with the base parameters, leave only noise.
//!
//! Forward: every effect of the library is scored at the residual of the present model. Those with the best first steps are
//! fitted jointly with everything in the model, and the one that reduces the cost of the fitted presses most is added. An
//! effect may be added again: real physics rarely has exactly the form in the library, and a second term of the same effect
//! is a simpler explanation than another effect. Backward: each effect is compared with the model without it, and with
//! every other effect in its place.

use std::collections::BTreeMap;

use tactus_model::effect::{Definition, ParameterKind};

use super::candidates::{Candidate, Screened};
use super::options::Options;
use super::score::{Fitting, Score, flipped, largest, p_value};
use crate::data::DiscoverError;
use crate::fit::{Fitted, Parameters, Problem, RANDOM_WALK, Term};
use crate::numbers::parallel;

/// A round of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// The effects in the model before this round.
    pub with: Vec<&'static str>,
    /// The effects that were tried, best first.
    pub candidates: Vec<TriedEffect>,
    /// The effect that was added, if any.
    pub taken: Option<&'static str>,
}

/// An effect that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct TriedEffect {
    /// Its name.
    pub effect: &'static str,
    /// Largest standardised score of a first step away from zero effect.
    pub score: f64,
    /// p-value of the score, corrected for all candidates of the round.
    pub p_value: f64,
    /// Root mean square of the held-out residuals of the model with this effect, if it was fitted.
    pub heldout_rms_counts: Option<f64>,
    /// Share of the gap that it closes on the held-out presses, if it was fitted.
    pub shrink: Option<f64>,
}

/// Number of sign-flipped data sets in a test.
pub(crate) const FLIPS: usize = 1999;
/// Probability of adding an effect to a complete model.
pub(crate) const ALPHA: f64 = 0.005;
/// Greatest number of candidates that a round fits.
pub(crate) const FITTED_MAX: usize = 7;
/// Greatest number of added terms.
pub(crate) const TERMS_MAX: usize = 7;
/// Greatest number of different added effects.
const NAMES_MAX: usize = 4;
/// Another term of an effect in the model is preferred to a new effect if its gain is more than this share of the new
/// effect's gain.
const AGAIN_SHARE: f64 = 0.5;
/// Rounds of a fit that compares candidates.
const TRIAL_ROUNDS: usize = 5;
/// Rounds after which candidates are given up whose gain is below a share of the best, and how many candidates go on.
const FIRST_ROUNDS: usize = 2;
const BEHIND_SHARE: f64 = 0.4;
const FINISHED_MAX: usize = 4;
/// A term whose gain is below this share of the gain of all before it only corrects their form. It is not added.
const GAIN_SHARE_LEAST: f64 = 0.01;
/// Rounds of a fit of a model that is kept.
pub(crate) const POLISH_ROUNDS: usize = 8;
/// By how much a term, and each of its parameters, must at least reduce the cost.
const PENALTY: f64 = 10.0;
const PENALTY_EACH: f64 = 6.0;
/// Greatest number of rivals that are fitted in an effect's place, and the least share of its gain that their first step
/// must promise.
const RIVALS_MAX: usize = 5;
const RIVAL_SHARE: f64 = 0.15;
/// Least share of the replaced effect's gain that a rival must reach within the first rounds.
const RIVAL_FITTED_SHARE: f64 = 0.5;
const EXCHANGES_MAX: usize = 3;
/// Two models are indistinguishable if they differ by fewer standard errors than this, or if one closes at least this
/// share of what the other closes.
const INSEPARABLE_Z: f64 = 3.0;
const INSEPARABLE_SHARE: f64 = 0.9;
/// An effect stays if its gain on the held-out presses is at least this many standard errors, and at least this share of the
/// certain remainder of the whole model.
const EARNS_Z: f64 = 2.0;
const EARNS_SHARE: f64 = 0.3;
/// Several effects are kept in place of a single one if their additional gain on the held-out presses is at least this many
/// standard errors, and at least this share of the single effect's gain.
const SEVERAL_Z: f64 = 3.0;
const SEVERAL_SHARE: f64 = 0.1;

/// Data, candidates and options of a search.
pub(crate) struct Search<'a> {
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) candidates: &'a [Candidate],
    pub(crate) options: Options,
    /// Number of terms of the known model and of faulty elements, which are never removed.
    pub(crate) known_terms: usize,
    /// Gap of the base model on the held-out presses; see `HeldOutGap`.
    pub(crate) base_gap: f64,
    pub(crate) progress: &'a (dyn Fn(&str) + Sync),
}

/// For each added effect, the rivals that explain the data as well in its place.
pub(crate) type Equivalent = BTreeMap<&'static str, Rivals>;

/// Effects that explain the data as well as an added one.
pub(crate) struct Rivals {
    /// The model without the effect.
    pub(crate) without: Fitted,
    /// The models with a rival in its place.
    pub(crate) same: Vec<(&'static str, Fitted)>,
}

/// Results of one round.
pub(crate) struct Tried {
    pub(crate) round: Round,
    /// Scores of all candidates.
    pub(crate) screened: Vec<Screened>,
    /// The fits, best first.
    pub(crate) fits: Vec<(&'static str, Fitted)>,
    /// p-value of the largest score of all candidates.
    pub(crate) p_value: f64,
}

/// The grown model, and the rounds that led to it.
pub(crate) struct Grown {
    pub(crate) at: Fitted,
    pub(crate) rounds: Vec<Tried>,
    pub(crate) equivalent: Equivalent,
    /// Reduction of the cost by added effects whose real form may differ from the library's.
    gained: f64,
}

impl From<Fitted> for Grown {
    fn from(base: Fitted) -> Self {
        Self { at: base, rounds: Vec::new(), equivalent: Equivalent::new(), gained: 0.0 }
    }
}

/// The part of the protocol at which a search is, for progress reports.
#[derive(Debug, Clone, Copy)]
pub(crate) enum SearchPhase {
    Pruning,
    Exchanging,
}

/// Result of the comparison of each effect with others in its place.
enum Exchanged {
    /// A model in which a rival is better.
    Better(Fitted),
    /// No rival is better.
    Settled(Equivalent),
}

impl Search<'_> {
    /// Scores of all candidates at a model.
    pub(crate) fn screen(&self, fitting: &Fitting<'_>, at: &Fitted) -> Result<Vec<Screened>, DiscoverError> {
        let mut screened = self.screen_among(|_| true, fitting, at)?;
        if screened.iter().any(|one| one.definition.name == RANDOM_WALK.name) {
            screened.extend(self.problem.screen_random_walk(fitting, &at.parameters));
        }
        Ok(screened)
    }

    /// Scores at a model of the candidates that `among` selects by name.
    fn screen_among(
        &self,
        among: impl Fn(&str) -> bool,
        fitting: &Fitting<'_>,
        at: &Fitted,
    ) -> Result<Vec<Screened>, DiscoverError> {
        let candidates: Vec<&Candidate> =
            self.candidates.iter().filter(|one| among(one.definition.name)).collect();
        let screen = |one: &&Candidate| one.screen(fitting, self.problem, at);
        parallel::map_longest_first(&candidates, |one| one.columns(), screen).into_iter().collect()
    }

    /// Grows a model until no effect is missing, unnecessary or worse than another.
    pub(crate) fn grow(&self, base: &Fitted, said: &dyn Fn(SearchPhase)) -> Result<Grown, DiscoverError> {
        let mut grown = Grown::from(base.clone());
        let mut exchanges_left = EXCHANGES_MAX;
        loop {
            self.forward(&mut grown)?;
            said(SearchPhase::Pruning);
            grown.at = self.back(grown.at)?;
            if let Some(simpler) = self.simpler(base, &grown.at)? {
                grown.at = simpler;
            }
            said(SearchPhase::Exchanging);
            match self.exchange(&grown.at, exchanges_left > 0)? {
                Exchanged::Better(better) => {
                    exchanges_left -= 1;
                    grown.at = self.problem.fit_from(better.parameters, POLISH_ROUNDS)?;
                }
                Exchanged::Settled(equivalent) => {
                    grown.equivalent = equivalent;
                    return Ok(grown);
                }
            }
        }
    }

    /// Adds effects until no candidate is significant.
    fn forward(&self, grown: &mut Grown) -> Result<(), DiscoverError> {
        loop {
            let at = &grown.at;
            let mut tried = self.round(at, grown.rounds.len())?;
            let full = at.parameters.terms.len() - self.known_terms >= TERMS_MAX;
            let Some((taken, fitted)) = self.take(at, &tried, grown.gained).filter(|_| !full) else {
                grown.rounds.push(tried);
                return Ok(());
            };
            (self.progress)(&format!("round {}: adding {taken}", grown.rounds.len() + 1));
            tried.round.taken = Some(taken);
            grown.rounds.push(tried);
            let fitted = self.problem.fit_from(fitted.parameters, POLISH_ROUNDS)?;
            if fitted.parameters.terms.last().is_some_and(|term| !is_exact(term.definition)) {
                grown.gained += grown.at.cost - fitted.cost;
            }
            grown.at = fitted;
        }
    }

    /// Scores every candidate, and fits the best if the scores are significant.
    pub(crate) fn round(&self, at: &Fitted, index: usize) -> Result<Tried, DiscoverError> {
        (self.progress)(&format!("round {}: scoring the effects", index + 1));
        let fitting = self.fitting(at)?;
        let screened = self.screen(&fitting, at)?;
        let groups: Vec<Vec<&Score>> = screened.iter().map(|one| one.scores.iter().collect()).collect();
        let under_none = flipped(&groups, FLIPS, self.options.seed ^ (index as u64 + 1));
        let largest = largest(&under_none);
        let statistic = |one: &Screened| one.scores.iter().map(|score| score.z).fold(0.0, f64::max);
        let mut tried: Vec<TriedEffect> = screened
            .iter()
            .map(|one| TriedEffect {
                effect: one.definition.name,
                score: statistic(one),
                p_value: p_value(statistic(one), &largest),
                heldout_rms_counts: None,
                shrink: None,
            })
            .collect();
        // Of two forms with one name, the one with the greater score.
        tried.sort_by(|a, b| a.effect.cmp(b.effect).then(b.score.total_cmp(&a.score)));
        tried.dedup_by_key(|one| one.effect);
        let p_value = tried.iter().map(|one| one.p_value).fold(1.0, f64::min);
        let mut order: Vec<usize> = (0..screened.len()).collect();
        order.sort_by(|a, b| screened[*b].promise.total_cmp(&screened[*a].promise));
        let wanted = 2.0 * p_value <= ALPHA;
        order.retain(|one| wanted && screened[*one].promise > PENALTY);
        let best = order.first().map_or(0.0, |one| screened[*one].promise);
        order.retain(|one| screened[*one].promise > 0.05 * best);
        order.truncate(FITTED_MAX);
        let starts: Vec<Term> = order.iter().map(|one| screened[*one].start.clone()).collect();
        let mut fits = self.fits(at, &starts, 0.0)?;
        fits.sort_by(|a, b| charged(&a.1).total_cmp(&charged(&b.1)));
        for (name, fitted) in fits.iter().rev() {
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
        Ok(Tried { round: Round { with: names, candidates: tried, taken: None }, screened, fits, p_value })
    }

    /// Fits of a model with each of the terms: first all in a few rounds, then the best to the end, if they reduce the cost by
    /// more than `gain_least`.
    pub(crate) fn fits(
        &self,
        at: &Fitted,
        starts: &[Term],
        gain_least: f64,
    ) -> Result<Vec<(&'static str, Fitted)>, DiscoverError> {
        let fit = |start: &Term| {
            (self.progress)(&format!("fitting {}", start.definition.name));
            let started = at.parameters.with(start.clone());
            Ok((start.definition.name, self.problem.fit_from(started, FIRST_ROUNDS)?))
        };
        let mut fits: Vec<(&'static str, Fitted)> =
            parallel::map_longest_first(starts, |one| one.values.len(), fit)
                .into_iter()
                .collect::<Result<_, DiscoverError>>()?;
        fits.sort_by(|a, b| charged(&a.1).total_cmp(&charged(&b.1)));
        let best = fits.first().map_or(0.0, |(_, best)| at.cost - best.cost);
        fits.retain(|(_, fitted)| at.cost - fitted.cost > gain_least.max(BEHIND_SHARE * best));
        fits.truncate(FINISHED_MAX);
        let finish = |(name, fitted): &(&'static str, Fitted)| {
            Ok((*name, self.problem.fit_from(fitted.parameters.clone(), TRIAL_ROUNDS)?))
        };
        parallel::map(&fits, finish).into_iter().collect()
    }

    /// The model's tangent space and residual.
    pub(crate) fn fitting(&self, at: &Fitted) -> Result<Fitting<'_>, DiscoverError> {
        Fitting::at(self.problem, &at.parameters, &at.predicted)
    }

    fn take(&self, at: &Fitted, tried: &Tried, gained: f64) -> Option<(&'static str, Fitted)> {
        let names = names(&at.parameters, self.known_terms);
        let allowed = |name: &&'static str| names.contains(name) || names.len() < NAMES_MAX;
        let (best_name, best) = tried.fits.iter().find(|(name, _)| allowed(name))?;
        let gain = charged(at) - charged(best);
        if gain <= PENALTY || gain < GAIN_SHARE_LEAST * gained {
            return None;
        }
        let again = tried.fits.iter().find(|(name, fitted)| {
            names.contains(name) && charged(at) - charged(fitted) > AGAIN_SHARE * gain
        });
        let (name, fitted) = again.map_or((best_name, best), |(name, fitted)| (name, fitted));
        Some((name, fitted.clone()))
    }

    /// A single effect, possibly with two terms, that explains nearly as much as several added ones. The others may only
    /// correct its form.
    fn simpler(&self, base: &Fitted, at: &Fitted) -> Result<Option<Fitted>, DiscoverError> {
        let alone = keeping(&at.parameters, self.known_terms, is_exact);
        let [all, exact] = [&at.parameters, &alone].map(|one| names(one, self.known_terms).len());
        if all < exact + 2 {
            return Ok(None);
        }
        (self.progress)("trying one effect in the place of several");
        let alone = if alone.terms.len() == self.known_terms {
            base.clone()
        } else {
            self.problem.fit_from(alone, POLISH_ROUNDS)?
        };
        let mut best: Option<Fitted> = None;
        let starts = self.starts(&alone, |_| true, RIVALS_MAX)?;
        let least = RIVAL_FITTED_SHARE * (alone.cost - at.cost);
        for (name, once) in self.fits(&alone, &starts, least)? {
            let once = self.problem.fit_from(once.parameters, POLISH_ROUNDS)?;
            let again = self.starts(&once, |other| other == name, 1)?.into_iter().next();
            let twice = again.map(|start| {
                let started = once.parameters.with(start);
                self.problem.fit_from(started, POLISH_ROUNDS)
            });
            for one in twice.transpose()?.into_iter().chain([once]) {
                if best.as_ref().is_none_or(|best| charged(&one) < charged(best)) {
                    best = Some(one);
                }
            }
        }
        Ok(best.filter(|one| {
            let [gain, error] = self.problem.heldout_gain(one, at);
            let [closed, _] = self.problem.heldout_gain(&alone, one);
            gain < (SEVERAL_Z * error).max(SEVERAL_SHARE * closed)
        }))
    }

    /// Starts of fits of the candidates with the best first steps, among those that `among` selects by name.
    fn starts(
        &self,
        at: &Fitted,
        among: impl Fn(&str) -> bool,
        most: usize,
    ) -> Result<Vec<Term>, DiscoverError> {
        let mut screened = self.screen_among(among, &self.fitting(at)?, at)?;
        screened.retain(|one| one.promise > PENALTY);
        screened.sort_by(|a, b| b.promise.total_cmp(&a.promise));
        screened.truncate(most);
        Ok(screened.into_iter().map(|one| one.start).collect())
    }

    /// Tries other effects in the place of each added one. Returns a better model, or else the rivals that are as good.
    fn exchange(&self, at: &Fitted, may_exchange: bool) -> Result<Exchanged, DiscoverError> {
        let mut equivalent = Equivalent::new();
        let mut at_leaves_something = None;
        let exact = names(&keeping(&at.parameters, self.known_terms, is_exact), self.known_terms);
        let names = names(&at.parameters, self.known_terms);
        // No other effect acts like miswired elements.
        for name in names.iter().filter(|name| !exact.contains(name)) {
            let less = without(&at.parameters, name, self.known_terms);
            let less = self.problem.fit_from(less, TRIAL_ROUNDS)?;
            let fitting = self.fitting(&less)?;
            let mut rivals = self.screen(&fitting, &less)?;
            rivals.retain(|one| !names.contains(&one.definition.name) && one.promise > PENALTY);
            rivals.sort_by(|a, b| b.promise.total_cmp(&a.promise));
            // An effect whose first step closes little of the gap is no rival.
            rivals.retain(|one| one.promise > RIVAL_SHARE * (less.cost - at.cost));
            rivals.truncate(RIVALS_MAX);
            let starts: Vec<Term> = rivals.into_iter().map(|one| one.start).collect();
            let fits = self.fits(&less, &starts, RIVAL_FITTED_SHARE * (less.cost - at.cost))?;
            let best = fits.iter().min_by(|a, b| charged(&a.1).total_cmp(&charged(&b.1)));
            if let Some((_, best)) =
                best.filter(|(_, best)| may_exchange && charged(best) < charged(at) - PENALTY)
            {
                return Ok(Exchanged::Better(best.clone()));
            }
            let mut same = Vec::new();
            for (rival, fitted) in fits {
                if self.serves_as_well(&less, &fitted, at, &mut at_leaves_something)? {
                    same.push((rival, fitted));
                }
            }
            equivalent.insert(*name, Rivals { without: less, same });
        }
        Ok(Exchanged::Settled(equivalent))
    }

    /// True if the data do not distinguish a rival from the effect in the model: it is hardly worse block by block, or it closes
    /// nearly as much of the gap, so that they may differ by an error of form only. The latter does not count if the rival
    /// leaves structure where the model leaves none.
    ///
    /// `at_leaves_something` caches whether the model leaves structure.
    fn serves_as_well(
        &self,
        less: &Fitted,
        rival: &Fitted,
        at: &Fitted,
        at_leaves_something: &mut Option<bool>,
    ) -> Result<bool, DiscoverError> {
        let (of_rival, of_model) =
            (self.problem.blocks(&rival.predicted), self.problem.blocks(&at.predicted));
        let worse: Vec<f64> = if [rival, at].iter().all(|one| one.parameters.walk.is_none()) {
            of_rival.iter().zip(&of_model).map(|(rival, model)| rival - model).collect()
        } else {
            // A random walk also fits noise where it is fitted.
            self.problem.heldout_gains(&rival.predicted, &at.predicted)
        };
        let sum: f64 = worse.iter().sum();
        let mean = sum / worse.len().max(1) as f64;
        let scatter = worse.iter().map(|one| (one - mean).powi(2)).sum::<f64>().sqrt();
        if sum < INSEPARABLE_Z * scatter {
            return Ok(true);
        }
        if less.cost - rival.cost <= INSEPARABLE_SHARE * (less.cost - at.cost) {
            return Ok(false);
        }
        let at_does = match *at_leaves_something {
            Some(known) => known,
            None => *at_leaves_something.insert(self.leaves_something(at)?),
        };
        Ok(at_does || !self.leaves_something(rival)?)
    }

    /// True if the residual of a model depends on any covariate.
    fn leaves_something(&self, one: &Fitted) -> Result<bool, DiscoverError> {
        Ok(self.locate(one)?.p_value <= ALPHA)
    }

    /// Removes added effects that the held-out presses do not support, one at a time.
    fn back(&self, mut at: Fitted) -> Result<Fitted, DiscoverError> {
        loop {
            let names = names(&at.parameters, self.known_terms);
            if names.is_empty() {
                return Ok(at);
            }
            let without = |name: &&'static str| {
                (self.progress)(&format!("without {name}"));
                self.problem.fit_from(without(&at.parameters, name, self.known_terms), TRIAL_ROUNDS)
            };
            let fits: Vec<Fitted> = parallel::map(&names, without).into_iter().collect::<Result<_, _>>()?;
            let left = EARNS_SHARE * self.problem.surely_left(&at);
            let worth = |less: &Fitted| {
                let [gain, error] = self.problem.heldout_gain(less, &at);
                // Significant, and not small against the certain remainder of the whole model.
                (gain / error.max(f64::MIN_POSITIVE) / EARNS_Z).min(if left > 0.0 {
                    gain / left
                } else {
                    f64::INFINITY
                })
            };
            let Some((least, worth)) = fits.iter().map(worth).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
            else {
                return Ok(at);
            };
            if worth >= 1.0 {
                return Ok(at);
            }
            let Some(simpler) = fits.into_iter().nth(least) else { return Ok(at) };
            at = self.problem.fit_from(simpler.parameters, POLISH_ROUNDS)?;
        }
    }
}

/// True if an effect has the same form in reality as in the library: wiring is right or wrong.
fn is_exact(definition: &Definition) -> bool {
    definition.parameters.iter().any(|parameter| parameter.kind == ParameterKind::Element)
}

/// Cost of a model plus a penalty for each parameter.
fn charged(fitted: &Fitted) -> f64 {
    let parameters: usize = fitted.parameters.terms.iter().map(|term| term.values.len()).sum();
    fitted.cost + PENALTY_EACH * parameters as f64
}

/// Names of the added effects, each once, in order.
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

/// A model without the added terms of an effect.
pub(crate) fn without(parameters: &Parameters, name: &str, known_terms: usize) -> Parameters {
    keeping(parameters, known_terms, |definition| definition.name != name)
}

/// A model with only those added terms that `stays` selects.
fn keeping(parameters: &Parameters, known_terms: usize, stays: impl Fn(&Definition) -> bool) -> Parameters {
    let mut less = parameters.clone();
    let mut index = 0;
    less.terms.retain(|term| {
        index += 1;
        index <= known_terms || stays(term.definition)
    });
    less
}
