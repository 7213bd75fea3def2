//! The draft of what a grown model leaves, and how much of it that closes on the held-out presses, which had no say in it.

use tactus_model::Effect;
use tactus_model::effect::{Definition, Draft, When};

use super::closed::{Closed, MOST_ERRORS};
use super::discovery::{BaseModel, Verdict};
use super::judged::TESTS;
use super::residual::{Presses, Residual};
use crate::data::{DiscoverError, Floor};
use crate::fit::{Fitted, Prepared, Term};
use crate::search::{
    ALPHA, Against, Drafted, FLIPS, NoDraft, Outcome, POLISH_ROUNDS, Rule, Search, sign_flip_p,
};

/// A draft that closes less of what was left on held-out presses is partial.
const CLOSED_LEAST: f64 = 0.7;
/// A draft describes what is left if it closes the better part of it on presses that no fit has seen.
pub(super) const BETTER_PART: f64 = 0.5;

/// An effect that was drafted, because no class explains what is left.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftedEffect {
    /// The effect; the model has it with a strength of 1.
    pub draft: Draft,
    /// Covariance of its law's numbers, or of a table's values.
    pub covariance: Vec<Vec<f64>>,
    /// Place, value and standard error of the knots of its curve, through which the law passes; none of two covariates or a tone.
    pub knots: Vec<[f64; 3]>,
    /// Probability that noise gives as much to any draft.
    pub p_value: f64,
    /// Logarithm of its odds against none.
    pub ln_odds: f64,
    /// In how many of five folds the same carrier and covariate come first.
    pub folds: usize,
    /// The classes that come nearest, and by how much the logarithm of the odds of each is behind.
    pub nearest: Vec<(&'static str, f64)>,
    /// Other drafts that these data cannot tell from it, in words.
    pub alike: Vec<String>,
    /// How much of what was left it closes on held-out presses; `None` where nothing was left there.
    pub closed: Option<Closed>,
    /// Root mean square of the residual on held-out presses without it and with it.
    pub heldout_rms_before_counts: f64,
    /// With it.
    pub heldout_rms_after_counts: f64,
    /// The base of the model with the draft.
    pub base: BaseModel,
    /// The effects of that model; the draft is the last one.
    pub effects: Vec<Effect>,
}

impl DraftedEffect {
    /// True if it closes less than 70 % of what was left.
    pub fn is_partial(&self) -> bool {
        self.closed.is_none_or(|closed| closed.share < CLOSED_LEAST)
    }
}

/// A grown model, and what is known of what it leaves.
pub(super) struct Leaves<'a> {
    pub(super) verdict: Verdict,
    /// True if a test rejects the model.
    pub(super) is_left: bool,
    /// True if what is seen may be what repeats of rounding.
    pub(super) may_be_rounding: bool,
    pub(super) grown: &'a Fitted,
    pub(super) floor: Floor,
    /// What a draft has to be better than.
    pub(super) against: Against<'a>,
}

/// Drafts what a grown model leaves, if that is anything. What is left may be too little for the verdict and still be seen. Where no test sees anything,
/// the drafts are one more test.
pub(super) fn drafted(
    prepared: &Prepared<'_>,
    search: &Search<'_>,
    leaves: &Leaves<'_>,
) -> Result<Option<Outcome>, DiscoverError> {
    let Leaves { verdict, is_left, may_be_rounding, grown, floor, against } = *leaves;
    let alpha = match verdict {
        Verdict::Unexplained | Verdict::PartlyExplained => ALPHA,
        Verdict::Explained if is_left => ALPHA,
        Verdict::NothingMissing | Verdict::CannotJudge if !may_be_rounding => ALPHA / TESTS as f64,
        Verdict::Explained | Verdict::NothingMissing | Verdict::CannotJudge => return Ok(None),
    };
    if search.options.rule != Rule::Protocol {
        return Ok(None);
    }
    let known = &prepared.known.effects;
    let is_known = |name: &str| {
        known.iter().any(|effect| effect.name() == name)
            || prepared.known.drafts.iter().any(|one| one.name == name)
    };
    // One of these is free.
    let numbers = 1..=known.len() + prepared.known.drafts.len() + 1;
    let name =
        numbers.map(|number| format!("draft-{number}")).find(|name| !is_known(name)).unwrap_or_default();
    // What is too little for the verdict, and acts where a name acts, may be an error of the name's form.
    let mut closed = Vec::new();
    if verdict == Verdict::Explained {
        let added = grown.parameters.terms.iter().skip(search.known_terms);
        closed.extend(added.map(|term| term.definition.stage()));
    }
    let refused = |why| Ok(is_open(verdict).then_some(Err(why)));
    let found = match search.draft(grown, &name, alpha, against, &closed)? {
        Ok(found) if repeats_of_rounding(prepared, grown, &found) => return refused(NoDraft::Rounding),
        Ok(found) => found,
        Err(why) => return refused(why),
    };
    if verdict != Verdict::Explained {
        let described = describing(prepared, grown, found, floor)?;
        return Ok(Some(described).filter(|described| described.is_ok() || is_open(verdict)));
    }
    // Names explain all that matters. A second covariate may have brought a draft to another stage.
    let stands = !closed.contains(&found.draft.stage())
        && sign_flip_p(&found.unseen_gains, FLIPS, search.options.seed) <= ALPHA;
    if !stands {
        return Ok(None);
    }
    Ok(describing(prepared, grown, found, floor)?.ok().map(Ok))
}

/// True if a draft may be what repeats of rounding: it acts in contact alone, by an amount of its own for each element, and changes a model there by no
/// more.
fn repeats_of_rounding(prepared: &Prepared<'_>, without: &Fitted, found: &Drafted) -> bool {
    if found.draft.when != When::InContact || found.draft.weights.is_none() {
        return false;
    }
    let (bins, noise) = (&prepared.bins, &prepared.noise);
    let more = |reading: usize| found.at.predicted[reading] - without.predicted[reading];
    let (mut squares, mut readings) = (0.0, 0.0);
    for bin in (0..bins.len()).filter(|bin| !bins.is_clear(prepared.frames, *bin)) {
        let of_elements = noise.by_element_counts.iter().enumerate().filter(|(_, noise)| noise.is_finite());
        for (element, noise) in of_elements {
            squares += bins.weight[bin] * (more(bin * bins.elements + element) / noise).powi(2);
            readings += bins.weight[bin];
        }
    }
    readings > 0.0 && noise.may_repeat(squares / readings)
}

/// A draft, if it closes the better part of what a model leaves, as folds of the fitted presses tell. They tell nothing of a model with a
/// random walk.
fn describing(
    prepared: &Prepared<'_>,
    grown: &Fitted,
    found: Box<Drafted>,
    floor: Floor,
) -> Result<Outcome, DiscoverError> {
    let by_folds = (prepared.by_folds(grown)?, prepared.by_folds(&found.at)?);
    let (Some((without, _)), Some((with, of_estimates))) = by_folds else { return Ok(Ok(found)) };
    let closed = prepared.closed_on([&without, &with], Presses::Fitted, of_estimates, floor);
    let most = |closed: &Closed| closed.share + MOST_ERRORS * closed.standard_error.unwrap_or(f64::INFINITY);
    Ok(match closed.filter(|closed| most(closed) < BETTER_PART) {
        Some(Closed { share, .. }) => Err(NoDraft::SmallerPart { sentence: found.draft.sentence, share }),
        None => Ok(found),
    })
}

/// True if a verdict leaves something that a draft may explain.
pub(super) const fn is_open(verdict: Verdict) -> bool {
    match verdict {
        Verdict::Unexplained | Verdict::PartlyExplained => true,
        Verdict::Explained | Verdict::NothingMissing | Verdict::CannotJudge => false,
    }
}

/// A draft with what it closes on the held-out presses of what a grown model leaves there.
pub(super) fn opened(
    prepared: &Prepared<'_>,
    found: Drafted,
    of_grown: &Residual,
    floor: Floor,
) -> Result<DraftedEffect, DiscoverError> {
    let Drafted { draft, at, covariance, knots, p_value, ln_odds, folds, nearest, alike, .. } = found;
    let of_draft = prepared.residual(&at.parameters)?;
    Ok(DraftedEffect {
        draft,
        covariance,
        knots,
        p_value,
        ln_odds,
        folds,
        nearest,
        alike,
        closed: prepared.closed([of_grown, &of_draft], &at, floor)?,
        heldout_rms_before_counts: of_grown.heldout_rms_counts,
        heldout_rms_after_counts: of_draft.heldout_rms_counts,
        base: super::conclude::base_of(prepared, &at.parameters),
        effects: at.parameters.effects()?,
    })
}

/// What a new measurement says of a draft.
#[derive(Debug, Clone, PartialEq)]
pub struct Confirmation {
    /// Its strength there; 1 as it was drafted.
    pub strength: f64,
    /// Standard error of the strength.
    pub strength_se: Option<f64>,
    /// How much of what the model leaves without it it closes on presses that were not fitted; `None` where nothing is left there.
    pub closed: Option<Closed>,
    /// Root mean square of the residual on those presses without it.
    pub heldout_rms_before_counts: f64,
    /// With it.
    pub heldout_rms_after_counts: f64,
}

/// The strength of a fitted draft, and its standard error. A tone has that of its amplitude, whatever its phase.
fn strength(term: &Term, errors: &[f64]) -> (f64, f64) {
    let [along, quadrature] = term.strength_of_draft();
    let Some(of_quadrature) = errors.get(1) else { return (along, errors[0]) };
    let amplitude = along.hypot(quadrature);
    (amplitude, (along * errors[0]).hypot(quadrature * of_quadrature) / amplitude)
}

/// A new measurement confirms a draft that closes so much of what is left there, and refutes one that closes less beyond two standard errors,
const CONFIRMED_LEAST: f64 = 0.8;
/// and whose strength there differs from 1 by no more than this, or by no more than so many standard errors.
const STRENGTH_APART: f64 = 0.3;
const STRENGTH_SE: f64 = 3.0;

impl Confirmation {
    /// Whether the draft holds. It does not if its strength differs from 1, or if it closes too little. `None` if these data do not tell: what it
    /// closes may be enough or not, by twice its standard error; nothing is left that a draft may close; or its strength is so uncertain that one
    /// of 0, which is no draft, would pass for 1.
    pub fn holds(&self) -> Option<bool> {
        let apart = (self.strength - 1.0).abs();
        let error = self.strength_se?;
        if apart > STRENGTH_APART && apart > STRENGTH_SE * error {
            return Some(false);
        }
        // No draft is apart by 1.
        if STRENGTH_SE * error >= 1.0 {
            return None;
        }
        let Closed { share, standard_error, .. } = self.closed?;
        let may_be = share + MOST_ERRORS * standard_error.unwrap_or(f64::INFINITY);
        (share >= CONFIRMED_LEAST || may_be < CONFIRMED_LEAST).then_some(share >= CONFIRMED_LEAST)
    }
}

/// Compares a draft with data that it was not drafted from.
pub(crate) fn confirmation(
    prepared: &Prepared<'_>,
    draft: &'static Definition,
) -> Result<Confirmation, DiscoverError> {
    let base = &prepared.base.parameters;
    let fitted = prepared.problem().fit_from(base.with(Term::of_draft(draft)), POLISH_ROUNDS)?;
    let (before, after) = (prepared.residual(base)?, prepared.residual(&fitted.parameters)?);
    let floor = prepared.floor_of(&after);
    let last = fitted.parameters.terms.last().zip(fitted.errors.last());
    let (strength, error) = last.map_or((0.0, f64::NAN), |(term, errors)| strength(term, errors));
    Ok(Confirmation {
        strength,
        strength_se: Some(error).filter(|error| error.is_finite()),
        closed: prepared.closed([&before, &after], &fitted, floor)?,
        heldout_rms_before_counts: before.heldout_rms_counts,
        heldout_rms_after_counts: after.heldout_rms_counts,
    })
}

#[cfg(test)]
#[path = "drafting_tests.rs"]
mod tests;
