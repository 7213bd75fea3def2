//! The [`Discovery`] that reports the outcome of a search.

use std::sync::Arc;

use tactus_model::{Effect, Response};

use super::confirmed::Confirmed;
use super::discovery::{
    AddedEffect, BaseModel, Discovery, ElementGap, Estimated, Final, GlobalTest, Inclusion, Level, Split,
    Stair, Unexplained, Verdict,
};
use super::drafting::{self, DraftedEffect};
use super::judged::{Judge, Judged, Opened, corrected, least_p_value};
use super::residual::{Residual, closed_share};
use crate::data::{DiscoverError, Fault, Gap};
use crate::fit::{Fitted, Parameters, Prepared, RandomWalk};
use crate::next::{DraftModel, Experiments, Explanation, Open, Pair, Plan, Planner};
use crate::search::{
    ALPHA, Alike, Contest, Equivalent, GivenUp, Left, Located, NoDraft, NotShown, Options, POLISH_ROUNDS,
    Round, Rule, Scattered, Search, Tried, names, not_shown, without,
};

/// The outcome of a search.
pub(crate) struct SearchOutcome {
    /// Effects that were not tried, because the data cannot show them.
    pub(crate) lacking: Vec<NotShown>,
    pub(crate) confirmed: Confirmed,
    pub(crate) rounds: Vec<Tried>,
    pub(crate) equivalent: Equivalent,
    /// True if the search ended because it had done as much as it may.
    pub(crate) is_cut: bool,
    pub(crate) contests: Vec<Contest>,
    /// Effects that another one replaced.
    pub(crate) exchanged: Vec<GivenUp>,
    /// Where the base model and the data disagree.
    pub(crate) before: Arc<Located>,
    /// Whether the noise is the same everywhere, at the base model.
    pub(crate) scattered: Scattered,
}

/// Said where the search ended at its bound.
const ENDED_EARLY: &str = "every effect leaves much, and the search was stopped at its bound: some combinations of effects were \
                           not tried";

/// Judges the outcome of a search and builds the report.
pub(crate) fn conclude(
    prepared: &Prepared<'_>,
    search: &Search<'_>,
    found: SearchOutcome,
    experiments: &dyn Experiments,
) -> Result<Discovery, DiscoverError> {
    let options = search.options;
    let SearchOutcome { lacking, confirmed, rounds, mut equivalent, contests, exchanged, .. } = found;
    let SearchOutcome { is_cut, before, scattered, .. } = found;
    let first = rounds.first();
    let base = &prepared.base;
    let of_base = prepared.residual(&base.parameters)?;
    let of_effects = first.map_or(1.0, |round| round.p_value);
    let own_noise = prepared.own_noise(&of_base);
    let p_value = least_p_value([of_effects, before.p_value, scattered.p_value, own_noise.p_value]);
    let judge = Judge {
        prepared,
        search,
        p_value,
        equivalent: &equivalent,
        contests: &contests,
        exchanged: &exchanged,
    };
    let judged = judge.judged(confirmed)?;
    search.reporter.tell("opening the held-out presses");
    let Opened { levels: [base_level, grown_level], closed, is_left, verdict } =
        judge.opened(&judged, &of_base)?;
    let Judged { confirmed, left, after, of_noise, residual: of_grown, floor, given_up, draft, .. } = judged;
    let with_draft = draft.as_ref().and_then(|found| found.as_ref().ok()).map(|found| DraftModel {
        name: found.name(),
        with: found.at.parameters.clone(),
        without: confirmed.grown.parameters.clone(),
    });
    let draft = match draft {
        Some(Ok(found)) => Some(Ok(Box::new(drafting::opened(prepared, *found, &of_grown, floor)?))),
        Some(Err(why)) => drafting::is_open(verdict).then_some(Err(why)),
        None => (drafting::is_open(verdict) && options.rule == Rule::Protocol)
            .then_some(Err(NoDraft::OnlyHeldOut)),
    };
    let few_presses = confirmed.few_presses();
    let Confirmed { grown, mut steps, tentative, .. } = confirmed;
    let names = names(&grown.parameters, search.known_terms);
    equivalent.retain(|name, _| names.contains(name));
    let noise_counts = floor.rms_counts().unwrap_or(0.0);
    let levels = [base_level, grown_level].map(|level| level.heldout_rms_counts);
    let staircase = search.staircase(&grown, levels, &steps, draft.as_ref())?;

    let mut not_shown = lacking;
    not_shown.extend(first.map_or_else(Vec::new, |round| not_shown::out_of_sight(&round.reach)));
    let mut effects = grown.parameters.effects()?;
    if let Some(converter) = &prepared.converter {
        let parameters = quantisation(&converter.fault);
        for of_one in &parameters {
            effects.push(Effect::new("quantisation", of_one.iter().copied())?);
        }
        steps.push(misread(&parameters, converter.p_value, grown_level.heldout_rms_counts));
    }
    let pairs = undecided(&equivalent, &grown);
    search.reporter.enter_planning(pairs.len() + usize::from(with_draft.is_some()));
    let plan = prepared.planner(experiments, options).plan(Open {
        pairs: &pairs,
        not_shown: &not_shown,
        at: &grown.parameters,
        draft: with_draft.as_ref(),
        lacks_repeats: verdict == Verdict::CannotJudge,
    })?;

    // No experiment would show them.
    not_shown.extend(search.drafts_not_tried().filter(|_| options.rule == Rule::Protocol));

    let is_clean = matches!(verdict, Verdict::NothingMissing | Verdict::CannotJudge);
    let is_added = !names.is_empty() || prepared.converter.is_some();
    let share = share_unexplained(verdict, is_added, search.share_left(base, &grown));
    let depends_on = match &draft {
        _ if is_clean => Vec::new(),
        _ if is_left => depends_on(&after, of_noise),
        // No other test sees what a draft describes.
        Some(Ok(found)) => found.draft.covariates.iter().map(|covariate| covariate.name()).collect(),
        Some(Err(_)) | None => Vec::new(),
    };
    let gap = if is_left && !is_clean { after.gap.clone() } else { Vec::new() };
    let unexplained = Unexplained { depends_on, gap, share };
    let ended_early = is_cut.then(|| ENDED_EARLY.to_owned());
    let of_search = few_presses.into_iter().chain(ended_early);
    let warnings =
        prepared.warnings.iter().cloned().chain(prepared.not_judged(&of_grown, floor)).chain(of_search);
    Ok(Discovery {
        not_shown,
        warnings: warnings.collect(),
        floor,
        global: Some(GlobalTest { statistic: before.statistic, p_value }),
        curves: search.curves(base, &grown)?,
        elements: of_base.elements_beside(&of_grown),
        rounds: rounds.into_iter().map(|tried| with_shares(tried.round, levels[0], noise_counts)).collect(),
        given_up,
        staircase,
        inclusions: inclusions(&steps, &equivalent, &left),
        contests,
        steps,
        tentative,
        final_: Final { level: grown_level, closed },
        verdict,
        draft,
        unexplained,
        plan,
        effects,
        grown: base_of(prepared, &grown.parameters),
        gap: before.gap.clone(),
        ..prepared.unjudged(&of_base, base_level, options)?
    })
}

/// The share of the gap that a model with this verdict leaves unexplained, of `left`, what it leaves.
fn share_unexplained(verdict: Verdict, is_added: bool, left: f64) -> f64 {
    match verdict {
        Verdict::NothingMissing => 0.0,
        Verdict::CannotJudge | Verdict::Unexplained => 1.0,
        // Faulty elements are in the base, so that nothing of its gap is left to close.
        Verdict::Explained if !is_added => 0.0,
        Verdict::Explained | Verdict::PartlyExplained => left,
    }
}

/// A round with the share of the gap that each fitted effect closes.
fn with_shares(mut round: Round, base_rms_counts: f64, noise_counts: f64) -> Round {
    for tried in &mut round.candidates {
        tried.shrink =
            tried.heldout_rms_counts.and_then(|rms| closed_share([base_rms_counts, rms], noise_counts));
    }
    round
}

/// On what the residual depends: covariates, and what the tests of the noise reject.
fn depends_on(located: &Located, of_noise: [Scattered; 2]) -> Vec<&'static str> {
    let of_noise = of_noise.into_iter().filter(|of| corrected(of.p_value) <= ALPHA).map(|of| of.with);
    located.gap.iter().map(|gap| gap.covariate).chain(of_noise).collect()
}

/// The report of data without a floor: figures of the base model in counts, no names, and what to measure next.
pub(crate) fn cannot_judge(
    prepared: &Prepared<'_>,
    options: Options,
    experiments: &dyn Experiments,
) -> Result<Discovery, DiscoverError> {
    let of_base = prepared.residual(&prepared.base.parameters)?;
    let unjudged = prepared.unjudged(&of_base, prepared.level(&of_base, prepared.floor), options)?;
    let at = &prepared.base.parameters;
    let nothing = Open { pairs: &[], not_shown: &[], at, draft: None, lacks_repeats: true };
    Ok(Discovery { plan: prepared.planner(experiments, options).plan(nothing)?, ..unjudged })
}

/// The probability of each effect: in any place of an added one, or missing beside them.
fn inclusions(steps: &[AddedEffect], equivalent: &Equivalent, left: &Left) -> Vec<Inclusion> {
    let in_place = |of: &Alike, name: &str| {
        of.probabilities.iter().find(|(one, _)| *one == name).map_or(0.0, |(_, probability)| *probability)
    };
    let probability = |name: &str, missing: f64| {
        let is_added = steps.iter().any(|step| step.effect == name);
        if is_added && !equivalent.contains_key(name) {
            // Nothing else acts like it.
            return 1.0;
        }
        let missing = if is_added { 0.0 } else { missing };
        1.0 - equivalent.values().map(|of| 1.0 - in_place(of, name)).product::<f64>() * (1.0 - missing)
    };
    let of = |(effect, missing): &(&'static str, f64)| Inclusion {
        effect,
        probability: probability(effect, *missing),
    };
    let mut inclusions: Vec<Inclusion> = left.probabilities.iter().map(of).collect();
    inclusions.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    inclusions
}

/// The added effects, each with an effect that the data do not distinguish from it.
fn undecided(equivalent: &Equivalent, grown: &Fitted) -> Vec<Pair> {
    let explained =
        |name: &'static str, fitted: &Fitted| Explanation { name, parameters: fitted.parameters.clone() };
    let pairs = equivalent.iter().flat_map(|(name, Alike { without, same, .. })| {
        same.iter().map(move |(rival, fitted)| Pair {
            of: [explained(name, grown), explained(rival, fitted)],
            without: without.parameters.clone(),
            gain: without.cost - grown.cost,
        })
    });
    pairs.collect()
}

/// Parameters of the effects that are a fault of the converter.
fn quantisation(fault: &Fault) -> Vec<Vec<(&'static str, f64)>> {
    match fault {
        Fault::WiderSteps(step_counts) => vec![vec![("step_counts", *step_counts)]],
        Fault::Gaps(gaps) => {
            let of_gap = |Gap { ends: [before, after], low_share }: &Gap| {
                vec![
                    ("step_counts", 0.0),
                    ("gap_from_counts", *before),
                    ("gap_counts", after - before),
                    ("gap_low_share", *low_share),
                ]
            };
            gaps.iter().map(of_gap).collect()
        }
    }
}

/// The added effect for a converter that is not as declared.
pub(super) fn misread(
    parameters: &[Vec<(&'static str, f64)>],
    p_value: f64,
    heldout_rms_counts: f64,
) -> AddedEffect {
    let estimated =
        |(name, value): &(&'static str, f64)| Estimated { name, value: *value, standard_error: None };
    AddedEffect {
        effect: "quantisation",
        terms: parameters.iter().map(|of_one| of_one.iter().map(estimated).collect()).collect(),
        p_value,
        q_value: p_value,
        folds_p_value: Some(p_value),
        // It does not change a mean.
        heldout_rms_before_counts: heldout_rms_counts,
        heldout_rms_after_counts: heldout_rms_counts,
        curves: Vec::new(),
        equivalent: Vec::new(),
    }
}

pub(super) fn base_of(prepared: &Prepared<'_>, parameters: &Parameters) -> BaseModel {
    let (sensitivity_counts_per_mm, run_gains) = parameters.centred();
    let response = Response {
        sensitivity_counts_per_mm,
        baseline_counts: parameters.mean_baseline(),
        ..prepared.known.response.clone()
    };
    BaseModel {
        psf: parameters.psf,
        response,
        run_gains,
        run_baselines_counts: parameters.baseline.clone(),
        run_walks: parameters.walk.as_ref().and_then(RandomWalk::apart),
    }
}

impl Prepared<'_> {
    /// A report of the recalibrated base model that judges nothing.
    fn unjudged(
        &self,
        of_base: &Residual,
        level: Level,
        options: Options,
    ) -> Result<Discovery, DiscoverError> {
        let element = |rms: &f64| ElementGap { before_rms_counts: *rms, after_rms_counts: *rms };
        let recalibrated = base_of(self, &self.base.parameters);
        Ok(Discovery {
            seed: options.seed,
            not_shown: Vec::new(),
            warnings: self.warnings.clone(),
            split: Split {
                frames: self.frames.len(),
                train_presses: self.heldout.train_presses,
                heldout_presses: self.heldout.presses,
                heldout_depths_mm: self.heldout.depths_mm.clone(),
                heldout_coverings_mm: self.heldout.coverings_mm.clone(),
            },
            heldout_frames: self.heldout.frames.clone(),
            floor: self.floor,
            tolerance_counts: options.tolerance_counts,
            faulty: self.faulty.elements.clone(),
            base: level,
            global: None,
            gap: Vec::new(),
            curves: Vec::new(),
            elements: of_base.elements_rms_counts.iter().map(element).collect(),
            rounds: Vec::new(),
            steps: Vec::new(),
            tentative: Vec::new(),
            inclusions: Vec::new(),
            contests: Vec::new(),
            final_: Final { level, closed: None },
            verdict: Verdict::CannotJudge,
            given_up: Vec::new(),
            staircase: Vec::new(),
            unexplained: Unexplained { depends_on: Vec::new(), gap: Vec::new(), share: 1.0 },
            draft: None,
            plan: Plan::default(),
            grown: recalibrated.clone(),
            recalibrated,
            effects: self.base.parameters.effects()?,
        })
    }

    fn planner<'p>(&'p self, experiments: &'p dyn Experiments, options: Options) -> Planner<'p> {
        Planner {
            known: self.known,
            frames: self.frames,
            noise: &self.noise,
            faulty: &self.faulty.elements,
            experiments,
            seed: options.seed,
        }
    }
}

impl Search<'_> {
    /// Remaining share of the gap, less the uncertainty of the noise.
    fn share_left(&self, base: &Fitted, grown: &Fitted) -> f64 {
        let left = self.problem.heldout_gap(&grown.predicted).sure();
        self.share_of(base, grown, left)
    }

    fn share_of(&self, base: &Fitted, grown: &Fitted, left: f64) -> f64 {
        let closed: f64 = self.problem.heldout_gains(&base.predicted, &grown.predicted).iter().sum();
        if closed + left > 0.0 { (left / (closed + left)).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// The residual on held-out presses as the grown model is built up, from the base model: with each added effect in order, all else fitted
    /// again, and with the draft.
    fn staircase(
        &self,
        grown: &Fitted,
        [base_rms_counts, grown_rms_counts]: [f64; 2],
        steps: &[AddedEffect],
        draft: Option<&Result<Box<DraftedEffect>, NoDraft>>,
    ) -> Result<Vec<Stair>, DiscoverError> {
        let stair = |with: &str, heldout_rms_counts| Stair { with: with.to_owned(), heldout_rms_counts };
        let names = names(&grown.parameters, self.known_terms);
        let mut stairs = vec![stair("base model", base_rms_counts)];
        for (place, name) in names.iter().enumerate() {
            let later = &names[place + 1..];
            // That of the model without the last one is known.
            let known = steps.iter().find(|step| later == [step.effect]);
            let rms_counts = match (later.is_empty(), known) {
                (true, _) => grown_rms_counts,
                (false, Some(step)) => step.heldout_rms_before_counts,
                (false, None) => {
                    let part = without(&grown.parameters, later, self.known_terms);
                    let fitted = self.problem.fit_from(part, POLISH_ROUNDS)?;
                    self.problem.heldout_rms_counts(&fitted.predicted)
                }
            };
            stairs.push(stair(name, rms_counts));
        }
        if let Some(Ok(draft)) = draft {
            stairs.push(stair(&draft.draft.name, draft.heldout_rms_after_counts));
        }
        Ok(stairs)
    }
}

#[cfg(test)]
#[path = "conclude_tests.rs"]
mod tests;
