//! Each class of a grown model has to hold its place: against the model without it, against rivals without a name, and against every other
//! class, each in its place. Classes that the data cannot tell apart in one place are reported as one set.

use tactus_model::Covariate;

use super::contests::Contest;
use super::draft::Drafted;
use super::evidence::{Set, excused};
use super::given_up::{Because, GivenUp};
use super::grow::{
    ALPHA, Alike, Beside, Equivalent, FORM_SHARE, Grown, Held, LN_ODDS_LEAST, POLISH_ROUNDS, PROMISE_SHARE,
    Search, TRIAL_ROUNDS, is_exact, names, without,
};
use super::pass::{Pass, rivals_win};
use super::varying::varying_effect;
use crate::data::DiscoverError;
use crate::fit::{Fitted, Parameters, Term};
use crate::numbers::parallel;
use crate::progress::Stage;

/// Another class takes the place of one if its odds are greater by this logarithm.
const BETTER_LN_ODDS: f64 = 3.0;
const EXCHANGES_MAX: usize = 4;
/// A class that leaves less than this share of what another leaves, as a square, leaves hardly anything of it: half of its rms.
const HARDLY_ANYTHING: f64 = 0.25;
/// Greatest number of other classes that are fitted in a class's place.
const OTHERS_MAX: usize = 4;
/// Probability of a reported set of classes.
pub const SET_PROBABILITY: f64 = 0.95;
/// By how many units a class at the end of such a set is behind the best.
const SET_UNITS: f64 = 3.0;

impl Search<'_> {
    /// Lets each class hold its place: against the model without it, rivals without a name, and other classes.
    pub(super) fn hold(&self, grown: &mut Grown) -> Result<(), DiscoverError> {
        let barred = grown.barred.len();
        let mut exchanges_left = EXCHANGES_MAX;
        // Classes whose form is right where that of another is not, with that other one.
        let mut right: Vec<[&'static str; 2]> = Vec::new();
        'again: loop {
            if self.is_back(grown, barred) {
                return Ok(());
            }
            // Whether the model leaves something, once that is asked.
            let mut leaves: Option<bool> = None;
            let mut equivalent = Equivalent::new();
            let names = names(&grown.at.parameters, self.known_terms);
            self.reporter.enter(Stage::Withdrawing, "withdrawing each name");
            let without = |name: &&'static str| {
                self.reporter.tell(&format!("without {name}"));
                let less = without(&grown.at.parameters, &[*name], self.known_terms);
                self.fitted(grown, less, TRIAL_ROUNDS)
            };
            let lesses: Vec<Fitted> =
                parallel::map(&names, without).into_iter().collect::<Result<_, DiscoverError>>()?;
            let odds: Vec<f64> = lesses.iter().map(|less| self.ln_odds(less, &grown.at)).collect();
            let worths: Vec<f64> = (0..names.len()).map(|index| Self::worth(index, &names, &odds)).collect();
            let weakest = worths.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
            if let Some((weakest, _)) = weakest.filter(|(_, worth)| **worth < 1.0) {
                grown.refused.push(self.too_small(names[weakest], odds[weakest], &grown.at));
                grown.at = self.fitted(grown, lesses[weakest].parameters.clone(), POLISH_ROUNDS)?;
                continue 'again;
            }
            for (nth, ((name, less), ln_odds)) in names.iter().zip(lesses).zip(odds.clone()).enumerate() {
                self.reporter.enter(
                    Stage::Comparing { left: names.len() - nth },
                    &format!("comparing {name} with others in its place"),
                );
                let pass = self.pass(&less)?;
                let (strength, mut rivals) = pass.rivalry(name, ln_odds);
                let odds_of = |effect| names.iter().zip(&odds).find(|(name, _)| **name == effect);
                let is_stronger = |effect| odds_of(effect).is_some_and(|(_, odds)| *odds > ln_odds);
                rivals.retain(|(rival, _)| varying_effect(rival).is_none_or(is_stronger));
                let unit = self.unit(ln_odds, &grown.at);
                if rivals_win(&rivals, strength) {
                    grown.refused.push(Contest::lost(name, ln_odds, self.left_over(&grown.at), rivals));
                    grown.barred.push((self.sorted_names(&less), name));
                    grown.at = self.fitted(grown, less.parameters, POLISH_ROUNDS)?;
                    continue 'again;
                }
                if is_exact(name) {
                    // No other effect acts like miswired elements.
                    continue;
                }
                let others = self.others(&pass, &less, &names, PROMISE_SHARE * ln_odds)?;
                let may_return = |other: &&Beside| !right.contains(&[*name, other.name]);
                let likeliest = others.iter().filter(may_return);
                let likeliest = likeliest.max_by(|a, b| self.rank(a).total_cmp(&self.rank(b)));
                let present = self.rank_of(name, ln_odds, &grown.at);
                let better = likeliest.filter(|best| self.rank(best) > present + BETTER_LN_ODDS);
                let better = match better {
                    _ if exchanges_left == 0 || self.is_spent() => None,
                    Some(better) => {
                        let from = better.fitted.parameters.clone();
                        Some((better.name, self.problem.fit_from(from, POLISH_ROUNDS)?))
                    }
                    None => {
                        let better = self.of_a_right_form(&grown.at, &less, (name, ln_odds), &others)?;
                        right.extend(better.iter().map(|(better, _)| [*better, *name]));
                        better
                    }
                };
                if let Some((better, fitted)) = better {
                    exchanges_left -= 1;
                    grown.exchanged.push(GivenUp { effect: name, because: Because::Other(better) });
                    grown.at = fitted;
                    continue 'again;
                }
                let classes = others.iter().map(|other| (other.name, other.ln_odds)).collect();
                let model_leaves = match leaves {
                    Some(known) => known,
                    None if others.is_empty() => true,
                    None => *leaves.insert(self.leaves_something(&grown.at)?),
                };
                // Where the model leaves nothing, its form is right, and only the other class needs another form than its own.
                let form_odds = if model_leaves { 1.0 } else { unit.sqrt() };
                let probabilities = probabilities(name, ln_odds, unit, form_odds, &others);
                let mut same = Vec::new();
                for (other, fitted) in credible(&probabilities, others) {
                    // Its form is no excuse for a class that leaves something where the model leaves nothing.
                    if model_leaves || !self.leaves_something(&fitted)? {
                        same.push((other, fitted));
                    }
                }
                equivalent.insert(name, Alike { without: less, same, probabilities, rivals, classes });
            }
            grown.equivalent = equivalent;
            grown.held = Some(Held { at: grown.at.clone(), rounds: grown.rounds.len() });
            return Ok(());
        }
    }

    /// True if the present model has the names of the last one that was held: then all that was added to that has lost its place, and the
    /// better fit of the two stays. If some of it lost against a rival, which are now more than `barred`, none of it is tried beside these
    /// names again.
    fn is_back(&self, grown: &mut Grown, barred: usize) -> bool {
        let present = self.sorted_names(&grown.at);
        let Some(held) = grown.held.as_mut().filter(|held| self.sorted_names(&held.at) == present) else {
            return false;
        };
        if held.at.cost <= grown.at.cost {
            grown.at = held.at.clone();
        } else {
            held.at = grown.at.clone();
        }
        if grown.barred.len() > barred {
            let added = grown.rounds[held.rounds..].iter().filter_map(|tried| tried.round.taken);
            let lost = added.filter(|name| !present.contains(name));
            grown.barred.extend(lost.map(|name| (present.clone(), name)));
        }
        true
    }

    /// A model fitted from these values, or the one that the rounds passed.
    fn fitted(&self, grown: &Grown, from: Parameters, rounds: usize) -> Result<Fitted, DiscoverError> {
        match grown.passed(&from) {
            Some(passed) => Ok(passed.clone()),
            None => self.problem.fit_from(from, rounds),
        }
    }

    /// The odds of a class over the least with which it holds its place: from 1 on it does. What is small beside the odds of another class may be
    /// that one's form.
    fn worth(index: usize, names: &[&'static str], odds: &[f64]) -> f64 {
        let others = names.iter().zip(odds).enumerate();
        let others = others.filter(|(other, (name, _))| *other != index && !is_exact(name));
        let strongest = others.map(|(_, (_, odds))| *odds).fold(0.0, f64::max);
        odds[index] / LN_ODDS_LEAST.max(FORM_SHARE * strongest)
    }

    /// True if a class explains little beside a draft: a model that has both is hardly nearer than one with the draft that is made without it.
    /// What is small beside the gain of the draft may be the draft's form.
    pub(crate) fn is_needless(&self, draft_ln_odds: f64, [alone, both]: [&Fitted; 2]) -> bool {
        self.ln_odds(alone, both) < LN_ODDS_LEAST.max(FORM_SHARE * draft_ln_odds)
    }

    /// True if the odds of a draft exceed those of all names together, by which one model is ahead of the other, by more than the misfit for which
    /// forms are excused.
    pub(crate) fn is_outdone(&self, [less, named]: [&Fitted; 2], draft: &Drafted) -> bool {
        let ln_odds = self.ln_odds(less, named);
        draft.ln_odds_as_chosen > ln_odds + excused(ln_odds)
    }

    /// True if a name of a model acts by a covariate.
    pub(crate) fn acts_by(&self, at: &Fitted, name: &str, covariate: Covariate) -> bool {
        self.added(at, name).any(|term| term.definition.acts_by.contains(&covariate))
    }

    /// A model without some of its names, fitted again.
    pub(crate) fn fitted_without(&self, at: &Fitted, names: &[&str]) -> Result<Fitted, DiscoverError> {
        if names.is_empty() {
            return Ok(at.clone());
        }
        self.problem.fit_from(without(&at.parameters, names, self.known_terms), POLISH_ROUNDS)
    }

    /// True if a name of a grown model explains little beside a draft that was made without any.
    pub(crate) fn is_needless_beside(
        &self,
        grown: &Fitted,
        name: &str,
        draft: &Drafted,
    ) -> Result<bool, DiscoverError> {
        let of_name = self.added(grown, name);
        let both = of_name.fold(draft.at.parameters.clone(), |both, term| both.with(term.clone()));
        let both = self.problem.fit_from(both, POLISH_ROUNDS)?;
        // A fit that does not come as near as the draft alone says nothing.
        Ok(both.cost <= draft.at.cost && self.is_needless(draft.ln_odds, [&draft.at, &both]))
    }

    /// The class with the greatest odds in the place of one that has its formula, if it leaves hardly anything of what that one leaves with
    /// its free part, too: a formula is excused for its form, which a free part does not have.
    fn of_a_right_form(
        &self,
        at: &Fitted,
        less: &Fitted,
        (name, ln_odds): (&'static str, f64),
        others: &[Beside],
    ) -> Result<Option<(&'static str, Fitted)>, DiscoverError> {
        let likeliest = others.iter().max_by(|a, b| a.ln_odds.total_cmp(&b.ln_odds));
        let likeliest = likeliest.filter(|other| other.ln_odds > ln_odds + BETTER_LN_ODDS);
        let has_formula = !self.added(at, name).any(Term::is_free);
        let knots = || self.as_knots(at, name).filter(|_| has_formula);
        let Some((other, knots)) = likeliest.and_then(|other| Some((other, knots()?))) else {
            return Ok(None);
        };
        let fitted = self.problem.fit_from(other.fitted.parameters.clone(), POLISH_ROUNDS)?;
        let free = self.with_knots(at, name, &knots)?;
        let is_ahead = self.ln_odds(less, &fitted) > self.ln_odds(less, &free) + BETTER_LN_ODDS;
        let leaves_little = self.left_over(&fitted) <= HARDLY_ANYTHING * self.left_over(&free);
        Ok((is_ahead && leaves_little).then_some((other.name, fitted)))
    }

    /// The other classes, fitted in a place, if their first steps promise these odds.
    pub(crate) fn others(
        &self,
        pass: &Pass,
        less: &Fitted,
        names: &[&'static str],
        ln_odds_least: f64,
    ) -> Result<Vec<Beside>, DiscoverError> {
        let evidence = pass.evidence();
        let among = pass.among(|name| !names.contains(&name));
        let mut best = evidence.sets_of_classes(&among, ln_odds_least);
        best.truncate(OTHERS_MAX);
        let start = |set: &Set| self.starts_of(pass, &evidence, set, pass.class_of(set.members[0]));
        let starts: Vec<(&'static str, Vec<Term>)> = best.iter().flat_map(start).collect();
        // Where the form misses much, more of them may be in the set.
        self.fits(less, &starts, SET_UNITS)
    }

    /// True if the residual of a model depends on any covariate.
    fn leaves_something(&self, at: &Fitted) -> Result<bool, DiscoverError> {
        Ok(self.locate(at)?.p_value <= ALPHA)
    }
}

/// Probabilities of a class with these odds, and of others in its place; likeliest others first.
fn probabilities(
    name: &'static str,
    ln_odds: f64,
    unit: f64,
    form_odds: f64,
    others: &[Beside],
) -> Vec<(&'static str, f64)> {
    let mut weights = vec![(name, 1.0)];
    weights.extend(
        others.iter().map(|other| (other.name, ((other.ln_odds - ln_odds) / unit).exp() / form_odds)),
    );
    weights[1..].sort_by(|a, b| b.1.total_cmp(&a.1));
    let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
    weights.into_iter().map(|(name, weight)| (name, weight / total)).collect()
}

/// The other classes of the smallest set that has, with the first class, the wanted probability.
fn credible(probabilities: &[(&'static str, f64)], mut others: Vec<Beside>) -> Vec<(&'static str, Fitted)> {
    let mut reached = 0.0;
    let mut same = Vec::new();
    for (place, (name, probability)) in probabilities.iter().enumerate() {
        if reached >= SET_PROBABILITY {
            break;
        }
        reached += probability;
        if let Some(other) = others.iter().position(|other| place > 0 && other.name == *name) {
            same.push((*name, others.swap_remove(other).fitted));
        }
    }
    same
}

#[cfg(test)]
#[path = "hold_tests.rs"]
mod tests;
