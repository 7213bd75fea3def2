//! The draft of what a grown model leaves, and how much of it that closes on presses that nobody had opened.

use tactus_model::Effect;
use tactus_model::effect::Draft;

use super::discovery::BaseModel;
use super::held_out::HeldOutResidual;
use crate::data::DiscoverError;
use crate::fit::{Fitted, Prepared};
use crate::search::{Drafted, NoDraft, Search};

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
    /// Share of what was left that it closes on held-out presses; `None` where nothing was left there.
    pub closed_share: Option<f64>,
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
        self.closed_share.is_none_or(|share| share < CLOSED_LEAST)
    }
}

/// Drafts what a grown model leaves.
pub(super) fn drafted(
    prepared: &Prepared<'_>,
    search: &Search<'_>,
    grown: &Fitted,
    of_grown: &HeldOutResidual,
    noise_counts: f64,
) -> Result<Result<Box<DraftedEffect>, NoDraft>, DiscoverError> {
    let number = 1 + prepared.known.drafts.len();
    let found = match search.draft(grown, number)? {
        Ok(found) => *found,
        Err(none) => return Ok(Err(none)),
    };
    let Drafted { draft, at, covariance, knots, p_value, ln_odds, folds, nearest, alike } = found;
    let after = prepared.held(&at.parameters)?;
    let [before, after] = [of_grown.rms_counts, after.rms_counts];
    let left = before * before - noise_counts * noise_counts;
    Ok(Ok(Box::new(DraftedEffect {
        draft,
        covariance,
        knots,
        p_value,
        ln_odds,
        folds,
        nearest,
        alike,
        closed_share: (left > 0.0).then(|| ((before * before - after * after) / left).min(1.0)),
        heldout_rms_before_counts: before,
        heldout_rms_after_counts: after,
        base: super::conclude::base_of(prepared, &at.parameters),
        effects: at.parameters.effects()?,
    })))
}

#[cfg(test)]
#[path = "drafting_tests.rs"]
mod tests;
