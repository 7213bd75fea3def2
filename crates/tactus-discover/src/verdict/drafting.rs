//! The draft of what a grown model leaves, and how much of it that closes on presses that nobody had opened.

use tactus_model::Effect;
use tactus_model::effect::{Definition, Draft};

use super::closed::Closed;
use super::discovery::{BaseModel, Verdict};
use super::held_out::HeldOutResidual;
use crate::data::{DiscoverError, Floor};
use crate::fit::{Fitted, Prepared, Term};
use crate::next::DraftModel;
use crate::search::{ALPHA, Against, Drafted, FLIPS, NoDraft, POLISH_ROUNDS, Rule, Search, sign_flip_p};

/// A draft that closes less of what was left on held-out presses is partial.
const CLOSED_LEAST: f64 = 0.7;

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
    /// True if another one acts on the same by the same.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        self.draft.carrier == other.draft.carrier && self.draft.covariates[0] == other.draft.covariates[0]
    }

    /// True if it closes less than 70 % of what was left.
    pub fn is_partial(&self) -> bool {
        self.closed.is_none_or(|closed| closed.share < CLOSED_LEAST)
    }
}

/// The draft of a discovery, or why there is none, and the model with it.
#[derive(Debug, Default)]
pub(super) struct Drafting {
    pub(super) draft: Option<Result<Box<DraftedEffect>, NoDraft>>,
    pub(super) model: Option<DraftModel>,
    /// That model as it was fitted.
    pub(super) at: Option<Fitted>,
}

/// A grown model, and what is known of what it leaves.
pub(super) struct Leaves<'a> {
    pub(super) verdict: Verdict,
    /// True if a test rejects the model.
    pub(super) is_left: bool,
    pub(super) grown: &'a Fitted,
    pub(super) of_grown: &'a HeldOutResidual,
    /// What a draft has to be better than.
    pub(super) against: Against<'a>,
}

/// Drafts what a grown model leaves, if that is anything. What is left may be too little for the verdict and still be seen.
pub(super) fn drafted(
    prepared: &Prepared<'_>,
    search: &Search<'_>,
    leaves: &Leaves<'_>,
    floor: Floor,
) -> Result<Drafting, DiscoverError> {
    let Leaves { verdict, is_left, grown, of_grown, against } = *leaves;
    let is_open = match verdict {
        Verdict::Unexplained | Verdict::PartlyExplained => true,
        Verdict::Explained => is_left,
        Verdict::NothingMissing | Verdict::CannotJudge => false,
    };
    if !is_open || search.options.rule != Rule::Protocol {
        return Ok(Drafting::default());
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
    let found = match search.draft(grown, &name, against, &closed)? {
        Ok(found) => *found,
        // Names explain all that matters, and nothing describes the rest better.
        Err(_) if verdict == Verdict::Explained => return Ok(Drafting::default()),
        Err(none) => return Ok(Drafting { draft: Some(Err(none)), ..Drafting::default() }),
    };
    if verdict == Verdict::Explained {
        // A second covariate may bring it to another stage.
        let acts_with_a_name = closed.contains(&found.draft.stage());
        let gains = search.problem.heldout_gains(&grown.predicted, &found.at.predicted);
        if acts_with_a_name || sign_flip_p(&gains, FLIPS, search.options.seed) > ALPHA {
            return Ok(Drafting::default());
        }
    }
    let Drafted { draft, at, covariance, knots, p_value, ln_odds, folds, nearest, alike } = found;
    let of_draft = prepared.held(&at.parameters)?;
    let closed = prepared.closed([of_grown, &of_draft], &at, floor)?;
    if closed.is_some_and(|closed| closed.most < 0.0) {
        return Ok(Drafting { draft: Some(Err(NoDraft::Further)), ..Drafting::default() });
    }
    let model = at.parameters.terms.last().map(|term| DraftModel {
        name: term.definition.name,
        with: at.parameters.clone(),
        without: grown.parameters.clone(),
    });
    let found = DraftedEffect {
        draft,
        covariance,
        knots,
        p_value,
        ln_odds,
        folds,
        nearest,
        alike,
        closed,
        heldout_rms_before_counts: of_grown.rms_counts,
        heldout_rms_after_counts: of_draft.rms_counts,
        base: super::conclude::base_of(prepared, &at.parameters),
        effects: at.parameters.effects()?,
    };
    Ok(Drafting { draft: Some(Ok(Box::new(found))), model, at: Some(at) })
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

/// A new measurement confirms a draft that closes so much of what is left there,
const CONFIRMED_LEAST: f64 = 0.8;
/// and whose strength there differs from 1 by no more than this, or by no more than so many standard errors.
const STRENGTH_APART: f64 = 0.3;
const STRENGTH_SE: f64 = 3.0;

impl Confirmation {
    /// True if the draft holds.
    pub fn holds(&self) -> bool {
        let apart = (self.strength - 1.0).abs();
        let is_as_strong =
            apart <= STRENGTH_APART || self.strength_se.is_some_and(|error| apart <= STRENGTH_SE * error);
        self.closed.is_some_and(|closed| closed.share >= CONFIRMED_LEAST) && is_as_strong
    }
}

/// Compares a draft with data that it was not drafted from.
pub(crate) fn confirmation(
    prepared: &Prepared<'_>,
    draft: &'static Definition,
) -> Result<Confirmation, DiscoverError> {
    let base = &prepared.base.parameters;
    let with = Term { values: vec![1.0], ..Term::neutral(draft) };
    let fitted = prepared.problem().fit_from(base.with(with), POLISH_ROUNDS)?;
    let (before, after) = (prepared.held(base)?, prepared.held(&fitted.parameters)?);
    let floor = prepared.floor_of(&after);
    let last = fitted.parameters.terms.last().zip(fitted.errors.last());
    let (strength, error) = last.map_or((0.0, f64::NAN), |(term, errors)| (term.values[0], errors[0]));
    Ok(Confirmation {
        strength,
        strength_se: Some(error).filter(|error| error.is_finite()),
        closed: prepared.closed([&before, &after], &fitted, floor)?,
        heldout_rms_before_counts: before.rms_counts,
        heldout_rms_after_counts: after.rms_counts,
    })
}

#[cfg(test)]
#[path = "drafting_tests.rs"]
mod tests;
