//! A grown model, judged by the fitted presses: what tests say of what it leaves, which names are only the nearest, and the draft. Then the
//! held-out presses are opened, for the figures and the verdict.
//!
//! A name may stand for what nobody has named, because a draft is tried only after all names. So each name has to hold its place beside
//! the draft: the model without it is judged and drafted anew. If the draft is of the same kind, and the model with it as near to the fitted presses,
//! the name gives way. Before that, all names together are compared with one draft that is made without any of them.

use std::sync::Arc;

use super::closed::Closed;
use super::confirmed::Confirmed;
use super::discovery::{AddedEffect, Level, Verdict};
use super::drafting::{BETTER_PART, Leaves, drafted};
use super::residual::{Presses, Residual, SEEN_NOISE};
use super::structured::Structured;
use crate::data::{DiscoverError, Floor, MISWIRED};
use crate::fit::{Fitted, Prepared};
use crate::progress::Stage;
use crate::search::{
    ALPHA, Against, Because, Contest, Drafted, Equivalent, GivenUp, Left, Located, NoDraft, Rule, Scattered,
    Search, last_words, names,
};

/// Upper bound of what is structured, in noise units, for the verdict `Explained` whatever the tests say.
const LITTLE_NOISE: f64 = 0.5;

/// An effect closes so much of the gap that its own physics makes, whatever its form. A name that closes less at most is only the nearest.
pub const NEAR_CLOSES: f64 = 0.85;

/// Effects that go where they like between two presses.
pub const DRIFTS: [&str; 2] = ["baseline-drift", "gain-drift"];

/// Judges grown models beside the base model.
pub(super) struct Judge<'a> {
    pub(super) prepared: &'a Prepared<'a>,
    pub(super) search: &'a Search<'a>,
    /// What tests say of the base model.
    pub(super) p_value: f64,
    pub(super) equivalent: &'a Equivalent,
    pub(super) contests: &'a [Contest],
    /// Effects that another one replaced.
    pub(super) exchanged: &'a [GivenUp],
}

/// A grown model, and what is known of it.
pub(super) struct Judged {
    pub(super) confirmed: Confirmed,
    /// What it may still lack, and where it disagrees with the data.
    pub(super) left: Left,
    pub(super) after: Arc<Located>,
    /// Whether its noise is the same everywhere, and each reading's own.
    pub(super) of_noise: [Scattered; 2],
    /// The least p-value of all tests, corrected.
    p_value: f64,
    pub(super) residual: Residual,
    pub(super) floor: Floor,
    /// What the fitted presses say.
    verdict: Verdict,
    /// Effects that it does not have, and why.
    pub(super) given_up: Vec<GivenUp>,
    /// The draft of what it leaves, or why there is none; `None` where nothing is left to draft.
    pub(super) draft: Option<Result<Box<Drafted>, NoDraft>>,
}

/// What the held-out presses say of a judged model.
pub(super) struct Opened {
    /// How far the base model and it are from them.
    pub(super) levels: [Level; 2],
    /// How much of the gap it closes there; `None` without a gap.
    pub(super) closed: Option<Closed>,
    /// A test rejects it.
    pub(super) is_left: bool,
    pub(super) verdict: Verdict,
}

impl Judge<'_> {
    /// Judges a model without the names that give way to a draft.
    pub(super) fn judged(&self, confirmed: Confirmed) -> Result<Judged, DiscoverError> {
        let mut judged = self.judge(confirmed, Vec::new(), None)?;
        judged = self.without_outdone_names(judged)?;
        while let Some(less) = self.without_a_needless_name(&judged)? {
            judged = less;
        }
        self.without_far_names(judged)
    }

    /// The model without the names that one draft outdoes: it alone, without any name, explains more than all of them together, and they hardly
    /// anything beside it. The draft may be another form of a name that acts by the same covariate. If one name does, and by itself explains the
    /// better part of what the draft does, all names stay.
    fn without_outdone_names(&self, judged: Judged) -> Result<Judged, DiscoverError> {
        let Self { prepared, search, equivalent, .. } = *self;
        let (names, grown) = (self.named(&judged.confirmed), &judged.confirmed.grown);
        // Where no class would gain anything beside the names, neither would a draft.
        let may_lose = !names.is_empty() && judged.left.is_much();
        if !may_lose || search.options.rule != Rule::Protocol {
            return Ok(judged);
        }
        let given_up = |names: &[&'static str]| -> Vec<GivenUp> {
            let gave_way = names.iter().map(|effect| GivenUp { effect, because: Because::Draft });
            judged.given_up.iter().cloned().chain(gave_way).collect()
        };
        let nameless = judged.confirmed.without(&names, prepared, search, equivalent)?;
        let against = Against::Names { nearest: names[0], cost: grown.cost };
        let nameless = self.judge(nameless, given_up(&names), Some(against))?;
        let base = &nameless.confirmed.grown;
        let Some(Ok(alone)) = &nameless.draft else { return Ok(judged) };
        if !search.is_outdone([base, grown], alone) {
            return Ok(judged);
        }
        let acts_alike = |name: &&str| search.acts_by(grown, name, alone.draft.covariates[0]);
        let alike: Vec<&str> = names.iter().copied().filter(acts_alike).collect();
        if let [name] = alike[..] {
            let others: Vec<&str> = names.iter().copied().filter(|other| *other != name).collect();
            let only = search.fitted_without(grown, &others)?;
            if base.cost - only.cost > BETTER_PART * (base.cost - alone.at.cost) {
                return Ok(judged);
            }
        }
        let mut gone = Vec::new();
        for name in &names {
            if search.is_needless_beside(grown, name, alone)? {
                gone.push(*name);
            }
        }
        if gone.len() == names.len() {
            return Ok(nameless);
        }
        if gone.is_empty() {
            return Ok(judged);
        }
        let less = judged.confirmed.without(&gone, prepared, search, equivalent)?;
        let less = self.judge(less, given_up(&gone), None)?;
        let is_there = matches!(&less.draft, Some(Ok(beside)) if beside.is_like(alone));
        Ok(if is_there { less } else { judged })
    }

    /// The model without the names that leave more of the gap than an effect leaves of its own physics. They come nearest, and are tentative; a
    /// draft has to come nearer than they. Between presses a drift goes where it likes, which no model closes, so that none
    /// is asked beside it.
    fn without_far_names(&self, judged: Judged) -> Result<Judged, DiscoverError> {
        let Self { prepared, search, equivalent, .. } = *self;
        let grown = &judged.confirmed.grown;
        let drifts = grown.parameters.terms.iter().any(|term| DRIFTS.contains(&term.definition.name));
        if judged.verdict != Verdict::PartlyExplained || drifts {
            return Ok(judged);
        }
        let Some((of_grown, of_estimates)) = prepared.by_folds(grown)? else { return Ok(judged) };
        let closed = |less: &Fitted| -> Result<Option<Closed>, DiscoverError> {
            let of_less = prepared.by_folds(less)?;
            let closed = |(of_less, _): (Residual, f64)| {
                prepared.closed_on([&of_less, &of_grown], Presses::Fitted, of_estimates, judged.floor)
            };
            Ok(of_less.and_then(closed))
        };
        let is_far = |closed: &Closed| closed.most < NEAR_CLOSES;
        if !closed(&prepared.base)?.is_some_and(|closed| is_far(&closed)) {
            return Ok(judged);
        }
        let mut far = Vec::new();
        for name in self.named(&judged.confirmed) {
            let less = judged.confirmed.without(&[name], prepared, search, equivalent)?;
            far.extend(closed(&less.grown)?.filter(is_far).map(|closed| (name, closed)));
        }
        let Some((nearest, _)) = far.first().copied() else { return Ok(judged) };
        let Judged { confirmed, mut given_up, .. } = judged;
        let gone: Vec<&str> = far.iter().map(|(name, _)| *name).collect();
        let mut less = confirmed.without(&gone, prepared, search, equivalent)?;
        less.tentative.extend(confirmed.steps.into_iter().filter(|step| gone.contains(&step.effect)));
        let of_far = |(effect, Closed { share, .. })| GivenUp { effect, because: Because::Far(share) };
        given_up.extend(far.into_iter().map(of_far));
        let against = Against::Names { nearest, cost: confirmed.grown.cost };
        self.judge(less, given_up, Some(against))
    }

    /// The names that may give way: a draft of the lab's library is no name that came first for want of a better one, and no draft acts like
    /// miswired elements.
    fn named(&self, confirmed: &Confirmed) -> Vec<&'static str> {
        let mut names = names(&confirmed.grown.parameters, self.search.known_terms);
        let is_draft = |name: &str| self.prepared.known.drafts.iter().any(|draft| draft.name == name);
        names.retain(|name| *name != MISWIRED && !is_draft(name));
        names
    }

    /// The model without a name, if what is drafted then acts by the same on the same, and explains as much as the name and the draft together.
    fn without_a_needless_name(&self, judged: &Judged) -> Result<Option<Judged>, DiscoverError> {
        let Some(Ok(beside)) = &judged.draft else { return Ok(None) };
        for name in self.named(&judged.confirmed) {
            let less = judged.confirmed.without(&[name], self.prepared, self.search, self.equivalent)?;
            let mut given_up = judged.given_up.clone();
            given_up.push(GivenUp { effect: name, because: Because::Draft });
            let less = self.judge(less, given_up, None)?;
            if let Some(Ok(alone)) = &less.draft
                && alone.is_like(beside)
                && self.search.is_needless(alone.ln_odds, [&alone.at, &beside.at])
            {
                return Ok(Some(less));
            }
        }
        Ok(None)
    }

    /// Judges a model. Its draft has to be better than the names `against` which it stands, or than every class that the data do not refute.
    fn judge(
        &self,
        confirmed: Confirmed,
        gave_way: Vec<GivenUp>,
        against: Option<Against<'_>>,
    ) -> Result<Judged, DiscoverError> {
        let Self { prepared, search, .. } = *self;
        let grown = &confirmed.grown;
        search.reporter.enter(Stage::LocatingLeft, "locating what remains");
        let left = search.left(grown)?;
        let after = search.locate(grown)?;
        let scattered = search.scattered(grown)?;
        search.reporter.enter(Stage::Judging, "judging what remains");
        let residual = prepared.residual(&grown.parameters)?;
        let of_noise = [scattered, prepared.own_noise(&residual)];
        let floor = prepared.floor_of(&residual);
        let p_value = least_p_value([left.p_value, after.p_value, of_noise[0].p_value, of_noise[1].p_value]);
        let structured = prepared.structured(&residual, Presses::Fitted, floor);
        // A model is never further than the base model from the presses that it was fitted to.
        let mut evidence = self.evidence(grown, p_value, floor, structured, None);
        let given_up = self.given_up(&confirmed, gave_way);
        let refuted: Vec<&str> =
            given_up.iter().filter(|one| one.is_refuted()).map(|one| one.effect).collect();
        let against = against.unwrap_or(Against::Classes { refuted: &refuted });
        let leaves = Leaves {
            verdict: evidence.verdict(),
            is_left: evidence.is_left,
            may_be_rounding: self.may_be_rounding(structured),
            grown,
            floor,
            against,
        };
        let draft = drafted(prepared, search, &leaves)?;
        evidence.is_missing |= matches!(draft, Some(Ok(_)));
        let verdict = evidence.verdict();
        Ok(Judged { confirmed, left, after, of_noise, p_value, residual, floor, verdict, given_up, draft })
    }

    /// Opens the held-out presses for a judged model, beside the residual of the base model.
    pub(super) fn opened(&self, judged: &Judged, of_base: &Residual) -> Result<Opened, DiscoverError> {
        let Judged { confirmed, p_value, residual, floor, .. } = judged;
        let grown = &confirmed.grown;
        let levels = [of_base, residual].map(|residual| self.prepared.level(residual, *floor));
        let closed =
            if self.has_gap() { self.prepared.closed([of_base, residual], grown, *floor)? } else { None };
        let mut evidence = self.evidence(grown, *p_value, *floor, levels[1].structured, closed);
        evidence.is_missing |= matches!(judged.draft, Some(Ok(_)));
        Ok(Opened { levels, closed, is_left: evidence.is_left, verdict: evidence.verdict() })
    }

    /// True if a test rejects the base model.
    fn has_gap(&self) -> bool {
        self.p_value <= ALPHA
    }

    /// What the verdict depends on, of a model with this p-value.
    fn evidence(
        &self,
        grown: &Fitted,
        p_value: f64,
        floor: Floor,
        structured: Option<Structured>,
        closed: Option<Closed>,
    ) -> Evidence {
        let Self { prepared, search, .. } = *self;
        let may_be_rounding = self.may_be_rounding(structured);
        let is_named = !names(&grown.parameters, search.known_terms).is_empty();
        let tolerance_counts = search.options.tolerance_counts;
        Evidence {
            is_named: is_named || prepared.converter.is_some() || !prepared.faulty.effects.is_empty(),
            is_missing: search.options.rule == Rule::Protocol
                && (self.has_gap() || has_refused(self.contests))
                && (is_named || !may_be_rounding),
            is_left: p_value <= ALPHA && !may_be_rounding,
            closed_most: closed.map_or(f64::INFINITY, |closed| {
                closed.share + closed.standard_error.unwrap_or(f64::INFINITY)
            }),
            upper_noise: upper_noise(structured),
            tolerance_noise: tolerance_counts
                .zip(floor.rms_counts())
                .map_or(0.0, |(tolerance, noise)| tolerance / noise),
        }
    }

    /// True if what is structured is no more than what repeats of rounding, which each test sees.
    fn may_be_rounding(&self, structured: Option<Structured>) -> bool {
        self.prepared.noise.may_be_rounding(upper_noise(structured).powi(2))
    }

    /// Effects that were fitted and are not in a model, and why.
    fn given_up(&self, confirmed: &Confirmed, gave_way: Vec<GivenUp>) -> Vec<GivenUp> {
        let unconfirmed = |step: &AddedEffect| GivenUp { effect: step.effect, because: Because::Unconfirmed };
        let all = self
            .exchanged
            .iter()
            .cloned()
            .chain(self.contests.iter().filter_map(Contest::given_up))
            .chain(confirmed.tentative.iter().map(unconfirmed))
            .chain(gave_way);
        let present: Vec<&str> = confirmed.steps.iter().map(|step| step.effect).collect();
        last_words(all.collect(), &present)
    }
}

/// The upper bound of what is structured; infinite if that is unknown.
fn upper_noise(structured: Option<Structured>) -> f64 {
    structured.map_or(f64::INFINITY, |part| part.upper_noise)
}

/// True if a class lost against a rival: it was fitted because a test of the effects rejects the model without it.
fn has_refused(contests: &[Contest]) -> bool {
    contests.iter().any(|contest| !contest.kept)
}

/// Tests of a model: by effects, by covariates, of the scatter, of the noise that should be each reading's own, and by drafts, which are looked for
/// where no other test rejects.
pub(super) const TESTS: usize = 5;

/// The least p-value of a model's tests but that by drafts, corrected.
pub(super) fn least_p_value(of_tests: [f64; TESTS - 1]) -> f64 {
    of_tests.into_iter().map(corrected).fold(1.0, f64::min)
}

/// A test's p-value by Bonferroni's correction.
pub(super) fn corrected(p_value: f64) -> f64 {
    (TESTS as f64 * p_value).min(1.0)
}

/// What the verdict depends on.
#[derive(Debug, Clone, Copy)]
struct Evidence {
    /// Effects were added and not withdrawn.
    is_named: bool,
    /// A test rejects the base model, or a draft tells what it misses.
    is_missing: bool,
    /// A test rejects the grown model.
    is_left: bool,
    /// The share of the gap on unseen presses that it closes, and a standard error; infinite if that is unknown. Below 0 the model is further
    /// from them than the base model, which explains nothing, however little is left.
    closed_most: f64,
    /// Upper bound of what is structured in the grown model's residual.
    upper_noise: f64,
    /// The tolerance that was declared beforehand; 0 if none was.
    tolerance_noise: f64,
}

impl Evidence {
    fn verdict(self) -> Verdict {
        let is_seen = self.upper_noise < SEEN_NOISE;
        let is_little = self.upper_noise < LITTLE_NOISE.max(self.tolerance_noise);
        let is_further = self.closed_most < 0.0;
        match (self.is_named, self.is_missing) {
            (false, false) if is_seen => Verdict::NothingMissing,
            // No test rejects, but there may be more than one would overlook.
            (false, false) => Verdict::CannotJudge,
            (false, true) => Verdict::Unexplained,
            (true, _) if !is_further && (is_little || is_seen && !self.is_left) => Verdict::Explained,
            (true, _) => Verdict::PartlyExplained,
        }
    }
}

#[cfg(test)]
#[path = "judged_tests.rs"]
mod tests;
