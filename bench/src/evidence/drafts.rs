//! Drafts of what no class explains, beside what is hidden.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tactus_hidden::DraftTruth;

use super::curves::Curve;
use super::outcome::Outcome;
use super::rate::{Rate, quantile};
use super::score::by_physics;

/// A draft closes a set if it closes this share of what was left on held-out presses.
const CLOSED_LEAST: f64 = 0.7;
/// The curve of a draft is near if its relative error is at most this.
const NEAR_MOST: f64 = 0.1;

/// The draft of a report.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Draft {
    /// Where it acts.
    pub stage: String,
    /// On what it depends.
    pub covariates: Vec<Covariate>,
    /// Share of what was left on held-out presses that it closes.
    pub closed_share: Option<f64>,
    /// How near its curve comes, if that is computed.
    #[serde(skip)]
    pub curve: Option<Curve>,
}

/// A covariate of a draft.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Covariate {
    /// Its name.
    pub covariate: String,
}

/// How drafts fare on some sets. The denominators are all of these sets.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct DraftScore {
    /// There is a draft.
    pub drafted: Rate,
    /// Its stage and its first covariate are right.
    pub right: Rate,
    /// It is right and closes most of what was left.
    pub right_and_closed: Rate,
    /// Curves of right drafts; `None` if that of any is not computed.
    pub curves: Option<CurveScore>,
}

/// How near the curves of right drafts come to the hidden physics.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CurveScore {
    /// The draft is right and its curve is near; of all sets.
    pub right_and_near: Rate,
    /// Median of the relative errors of right drafts.
    pub median_error: Option<f64>,
}

/// Drafts by purpose of the sets.
#[derive(Debug, Clone, Serialize)]
pub struct DraftScores {
    /// Physics outside the library that has a mean: `all` and by physics.
    pub outside: BTreeMap<String, DraftScore>,
    /// Physics that is drawn anew for each reading: any draft is one too many.
    pub of_single: Rate,
    /// Sets without hidden physics.
    pub of_nothing: Rate,
    /// Sets with one effect of the library.
    pub of_named: Rate,
}

impl Draft {
    /// True if it is a right draft of a physics.
    pub(super) fn is_right(&self, physics: &str) -> bool {
        let covariate = self.covariates.first().map(|first| first.covariate.as_str());
        DraftTruth::find(physics).is_some_and(|truth| {
            truth.stages.contains(&self.stage.as_str())
                && covariate.is_some_and(|covariate| truth.covariates.contains(&covariate))
        })
    }
}

impl DraftScore {
    fn of(sets: &[&Outcome]) -> Self {
        let is_right = |set: &Outcome| {
            let physics = set.truths.first().map_or("", |truth| truth.physics.as_str());
            set.draft.as_ref().is_some_and(|draft| draft.is_right(physics))
        };
        let closes = |set: &Outcome| {
            let closed = set.draft.as_ref().and_then(|draft| draft.closed_share);
            closed.is_some_and(|share| share >= CLOSED_LEAST)
        };
        Self {
            drafted: Rate::of(sets, |set| set.draft.is_some()),
            right: Rate::of(sets, |set| is_right(set)),
            right_and_closed: Rate::of(sets, |set| is_right(set) && closes(set)),
            curves: CurveScore::of(sets, is_right),
        }
    }
}

impl CurveScore {
    fn of(sets: &[&Outcome], is_right: impl Fn(&Outcome) -> bool) -> Option<Self> {
        let right = sets.iter().filter(|set| is_right(set));
        let error = |set: &&Outcome| {
            let curve = set.draft.as_ref()?.curve.as_ref()?;
            // A draft of what does not show on the other path is not near.
            Some(curve.error.unwrap_or(f64::INFINITY))
        };
        let errors: Vec<f64> = right.map(error).collect::<Option<_>>()?;
        let near = errors.iter().filter(|error| **error <= NEAR_MOST).count();
        Some(Self { right_and_near: Rate::new(near, sets.len()), median_error: quantile(errors, 0.5) })
    }
}

impl DraftScores {
    /// The scores of sets without physics, with one effect of the library, and with physics outside it.
    pub fn new(nothing: &[&Outcome], named: &[&Outcome], outside: &[&Outcome]) -> Self {
        let has_mean =
            |set: &&&Outcome| set.truths.iter().any(|truth| DraftTruth::find(&truth.physics).is_some());
        let (mean, single): (Vec<&Outcome>, Vec<&Outcome>) =
            outside.iter().copied().partition(|set| has_mean(&set));
        let groups = by_physics(&mean);
        let drafted = |sets: &[&Outcome]| Rate::of(sets, |set| set.draft.is_some());
        Self {
            outside: groups.into_iter().map(|(group, sets)| (group, DraftScore::of(&sets))).collect(),
            of_single: drafted(&single),
            of_nothing: drafted(nothing),
            of_named: drafted(named),
        }
    }
}

#[cfg(test)]
#[path = "drafts_tests.rs"]
mod tests;
