//! A grown model, judged: what tests say of what it leaves, how near it is to the held-out presses, the verdict, and the draft.
//!
//! A name may stand for what nobody has named, because a draft is tried only after all names. So each name has to hold its place beside
//! the draft: the model without it is judged and drafted anew. If the draft is of the same kind, and the model with it as near to the fitted presses,
//! the name gives way.

use std::sync::Arc;

use super::closed::Closed;
use super::confirmed::Confirmed;
use super::discovery::{AddedEffect, Level, Verdict};
use super::drafting::{Drafting, Leaves, drafted};
use super::held_out::{HeldOutResidual, SEEN_NOISE};
use crate::data::{DiscoverError, Floor, MISWIRED};
use crate::fit::Prepared;
use crate::progress::Stage;
use crate::search::{
    ALPHA, Against, Because, Contest, Equivalent, GivenUp, Left, Located, Rule, Scattered, Search,
    last_words, names,
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
    /// The base model's residual on the held-out presses.
    pub(super) of_base: &'a HeldOutResidual,
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
    pub(super) held: HeldOutResidual,
    pub(super) floor: Floor,
    /// How far the base model and it are from the held-out presses.
    pub(super) levels: [Level; 2],
    /// How much of the gap it closes there; `None` without a gap.
    pub(super) closed: Option<Closed>,
    /// A test rejects it.
    pub(super) is_left: bool,
    pub(super) verdict: Verdict,
    /// Effects that it does not have, and why.
    pub(super) given_up: Vec<GivenUp>,
    pub(super) drafting: Drafting,
}

impl Judge<'_> {
    /// Judges a model without the names that give way to a draft.
    pub(super) fn judged(&self, confirmed: Confirmed) -> Result<Judged, DiscoverError> {
        let mut judged = self.judge(confirmed, Vec::new(), None)?;
        while let Some(less) = self.without_a_needless_name(&judged)? {
            judged = less;
        }
        self.without_far_names(judged)
    }

    /// The model without the names that leave more of the gap than an effect leaves of its own physics. They come nearest, and are tentative; a
    /// draft has to come nearer than they. Between presses a drift goes where it likes, which no model closes, so that none
    /// is asked beside it.
    fn without_far_names(&self, judged: Judged) -> Result<Judged, DiscoverError> {
        let is_far = |closed: &Closed| closed.most < NEAR_CLOSES;
        let drifts =
            judged.confirmed.grown.parameters.terms.iter().any(|term| DRIFTS.contains(&term.definition.name));
        let is_asked = judged.verdict == Verdict::PartlyExplained && !drifts;
        if !is_asked || !judged.closed.is_some_and(|closed| is_far(&closed)) {
            return Ok(judged);
        }
        let mut far = Vec::new();
        for name in self.named(&judged.confirmed) {
            let less = judged.confirmed.without(&[name], self.prepared, self.search, self.equivalent)?;
            let of_less = self.prepared.held(&less.grown.parameters)?;
            let both = [&of_less, &judged.held];
            let closed = self.prepared.closed(both, &judged.confirmed.grown, judged.floor)?;
            far.extend(closed.filter(is_far).map(|closed| (name, closed)));
        }
        let Some((nearest, _)) = far.first().copied() else { return Ok(judged) };
        let Judged { confirmed, mut given_up, .. } = judged;
        let gone: Vec<&str> = far.iter().map(|(name, _)| *name).collect();
        let mut less = confirmed.without(&gone, self.prepared, self.search, self.equivalent)?;
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
        let Drafting { draft: Some(Ok(beside)), at: Some(both), .. } = &judged.drafting else {
            return Ok(None);
        };
        for name in self.named(&judged.confirmed) {
            let less = judged.confirmed.without(&[name], self.prepared, self.search, self.equivalent)?;
            let mut given_up = judged.given_up.clone();
            given_up.push(GivenUp { effect: name, because: Because::Draft });
            let less = self.judge(less, given_up, None)?;
            if let Drafting { draft: Some(Ok(draft)), at: Some(alone), .. } = &less.drafting
                && draft.is_like(beside)
                && self.search.is_needless(draft.ln_odds, [alone, both])
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
        let Self { prepared, search, of_base, .. } = *self;
        let Prepared { converter, faulty, .. } = prepared;
        let grown = &confirmed.grown;
        search.reporter.enter(Stage::LocatingLeft, "locating what remains");
        let left = search.left(grown)?;
        let after = search.locate(grown)?;
        let scattered = search.scattered(grown)?;
        search.reporter.enter(Stage::Judging, "judging the held-out presses");
        let held = prepared.held(&grown.parameters)?;
        let of_noise = [scattered, prepared.own_noise(&held)];
        let of_tests = [left.p_value, after.p_value, of_noise[0].p_value, of_noise[1].p_value];
        let floor = prepared.floor_of(&held);
        let levels = [of_base, &held].map(|held| prepared.level(held, floor));
        let upper_noise = levels[1].structured.map_or(f64::INFINITY, |part| part.upper_noise);
        // Each test sees what repeats of rounding.
        let may_be_rounding = prepared.noise.may_be_rounding(upper_noise * upper_noise);
        let is_left = least_p_value(of_tests) <= ALPHA && !may_be_rounding;
        let has_gap = self.p_value <= ALPHA;
        let closed = if has_gap { prepared.closed([of_base, &held], grown, floor)? } else { None };
        let is_named = !names(&grown.parameters, search.known_terms).is_empty();
        let tolerance_counts = search.options.tolerance_counts;
        let evidence = Evidence {
            is_named: is_named || converter.is_some() || !faulty.effects.is_empty(),
            is_missing: search.options.rule == Rule::Protocol
                && (has_gap || has_refused(self.contests))
                && (is_named || !may_be_rounding),
            is_left,
            closed_most: closed.map_or(f64::INFINITY, |closed| {
                closed.share + closed.standard_error.unwrap_or(f64::INFINITY)
            }),
            upper_noise,
            tolerance_noise: tolerance_counts
                .zip(floor.rms_counts())
                .map_or(0.0, |(tolerance, noise)| tolerance / noise),
        };
        let verdict = evidence.verdict();
        let given_up = self.given_up(&confirmed, gave_way);
        let refuted: Vec<&str> =
            given_up.iter().filter(|one| one.is_refuted()).map(|one| one.effect).collect();
        let against = against.unwrap_or(Against::Classes { refuted: &refuted });
        let leaves = Leaves { verdict, is_left, grown, of_grown: &held, against };
        let drafting = drafted(prepared, search, &leaves, floor)?;
        Ok(Judged {
            confirmed,
            left,
            after,
            of_noise,
            held,
            floor,
            levels,
            closed,
            is_left,
            verdict,
            given_up,
            drafting,
        })
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

/// True if a class lost against a rival: it was fitted because a test of the effects rejects the model without it.
fn has_refused(contests: &[Contest]) -> bool {
    contests.iter().any(|contest| !contest.kept)
}

/// Tests of a model: by effects, by covariates, of the scatter, and of the noise that should be each reading's own.
const TESTS: usize = 4;

/// The least p-value of a model's tests, corrected.
pub(super) fn least_p_value(of_tests: [f64; TESTS]) -> f64 {
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
    /// A test rejects the base model.
    is_missing: bool,
    /// A test rejects the grown model.
    is_left: bool,
    /// The share of the gap on held-out presses that it closes, and a standard error; infinite if that is unknown. Below 0 the model is further
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
