//! The verdict on a search, and the [`Discovery`] that reports it.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use tactus_model::{Effect, Response};

use super::discovery::{
    AddedEffect, BaseModel, Discovery, ElementGap, Estimated, Final, FittedCurve, FittedKnot, GlobalTest,
    Inclusion, Level, Split, Stair, Unexplained, Verdict,
};
use super::drafting::{DraftedEffect, Drafting, Leaves, drafted};
use super::held_out::{HeldOutResidual, SEEN_NOISE, closed_share};
use crate::data::{DiscoverError, MISWIRED};
use crate::fit::{Fitted, FoldsOf, Parameters, Prepared, Problem, RandomWalk, Term, gains_by_folds};
use crate::next::{Experiments, Explanation, Open, Pair, Plan, Planner};
use crate::progress::Stage;
use crate::search::{
    ALPHA, Alike, Because, Contest, Equivalent, FLIPS, Formed, GivenUp, Left, Located, NoDraft, NotShown,
    Options, POLISH_ROUNDS, Refuted, RefutedFormula, Round, Rule, Scattered, Search, Tried, last_words,
    names, not_shown, q_values, sign_flip_p, without,
};

/// An effect is confirmed if noise alone would let it gain as much, on fitted presses that its parameters have not seen, with at most this
/// probability.
const CONFIRMED_P: f64 = 0.05;
/// Few blocks cannot give so small a probability. They confirm if all agree: then it is the least that they can give, and otherwise at
/// least twice as much.
const AGREED: f64 = 1.5;
/// Upper bound of what is structured, in noise units, for the verdict `Explained` whatever the tests say.
const LITTLE_NOISE: f64 = 0.5;
/// The outcome of a search.
pub(crate) struct SearchOutcome {
    /// Effects that were not tried, because the data cannot show them.
    pub(crate) lacking: Vec<NotShown>,
    pub(crate) base: Fitted,
    pub(crate) confirmed: Confirmed,
    pub(crate) rounds: Vec<Tried>,
    pub(crate) equivalent: Equivalent,
    pub(crate) contests: Vec<Contest>,
    /// Effects that another one replaced.
    pub(crate) exchanged: Vec<GivenUp>,
    /// What the grown model may still lack.
    pub(crate) left: Left,
    /// Where the base model and the data disagree, and where the grown model still does.
    pub(crate) before: Arc<Located>,
    pub(crate) after: Arc<Located>,
    /// Whether the noise is the same everywhere, at the base model and at the grown one.
    pub(crate) scatters: [Scattered; 2],
}

/// A grown model whose effects are confirmed.
pub(crate) struct Confirmed {
    pub(crate) grown: Fitted,
    /// Its added effects.
    pub(crate) steps: Vec<AddedEffect>,
    /// Those that are not confirmed.
    pub(crate) tentative: Vec<AddedEffect>,
    /// Those with which all blocks agree, too few as they are.
    pub(crate) agreed: Vec<&'static str>,
}

/// An added effect, and whether presses that its parameters have not seen confirm it.
pub(crate) struct Step {
    added: AddedEffect,
    /// The least probability that flips of so few blocks can give.
    least_p: f64,
}

impl Step {
    fn is_confirmed(&self) -> bool {
        self.added.folds_p_value <= CONFIRMED_P.max(AGREED * self.least_p)
    }
}

/// A model with those of its added effects that folds of the fitted presses confirm. The held-out presses have no say.
pub(crate) fn confirmed(
    prepared: &Prepared<'_>,
    search: &Search<'_>,
    formed: Formed,
    equivalent: &mut Equivalent,
) -> Result<Confirmed, DiscoverError> {
    let Formed { at: grown, refuted } = formed;
    let with_silent = prepared.problem_with_silent();
    let names = names(&grown.parameters, search.known_terms);
    search.reporter.enter(Stage::Confirming, "confirming the names on folds of presses");
    let steps = search.steps(&grown, equivalent, &refuted, &with_silent)?;
    // A miswired element acts on its own readings, of which a fold may have none.
    let is_firm = |step: &Step| {
        !names.contains(&step.added.effect) || step.added.effect == MISWIRED || step.is_confirmed()
    };
    let (steps, tentative): (Vec<Step>, Vec<Step>) = steps.into_iter().partition(is_firm);
    let added = |steps: Vec<Step>| steps.into_iter().map(|step| step.added).collect();
    let few = |step: &&Step| names.contains(&step.added.effect) && step.added.folds_p_value > CONFIRMED_P;
    let agreed = steps.iter().filter(few).map(|step| step.added.effect).collect();
    if tentative.is_empty() {
        return Ok(Confirmed { grown, steps: added(steps), tentative: Vec::new(), agreed });
    }
    let mut firm = grown.parameters;
    for step in &tentative {
        equivalent.remove(step.added.effect);
        firm = without(&firm, step.added.effect, search.known_terms);
    }
    let grown = search.problem.fit_from(firm, POLISH_ROUNDS)?;
    let steps = search.steps(&grown, equivalent, &refuted, &with_silent)?;
    Ok(Confirmed { grown, steps: added(steps), tentative: added(tentative), agreed })
}

/// Decides the verdict and builds the report of a search.
pub(crate) fn conclude(
    prepared: &Prepared<'_>,
    search: &Search<'_>,
    found: SearchOutcome,
    options: Options,
    experiments: &dyn Experiments,
) -> Result<Discovery, DiscoverError> {
    let Prepared { lattice, faulty, .. } = prepared;
    let SearchOutcome {
        lacking,
        base,
        confirmed,
        rounds,
        equivalent,
        contests,
        exchanged,
        left,
        before,
        after,
        scatters,
    } = found;
    let Confirmed { grown, mut steps, tentative, agreed } = confirmed;
    let first = rounds.first();
    let share = search.share_left(&base, &grown);
    let named = !names(&grown.parameters, search.known_terms).is_empty();
    let (of_base, of_grown) = (prepared.held(&base.parameters)?, prepared.held(&grown.parameters)?);
    let [noise_of_base, noise_of_grown] = [&of_base, &of_grown].map(|held| prepared.own_noise(held));
    let of_effects = first.map_or(1.0, |round| round.p_value);
    let p_value = least_p_value([of_effects, before.p_value, scatters[0].p_value, noise_of_base.p_value]);
    let is_left =
        least_p_value([left.p_value, after.p_value, scatters[1].p_value, noise_of_grown.p_value]) <= ALPHA;
    let floor = prepared.floor_of(&of_grown);
    let [base_level, grown_level] = [&of_base, &of_grown].map(|held| prepared.level(held, floor));
    let upper_noise = grown_level.structured.map_or(f64::INFINITY, |part| part.upper_noise);
    let has_gap = p_value <= ALPHA;
    let closed = if has_gap { prepared.closed([&of_base, &of_grown], &grown, floor)? } else { None };
    let evidence = Evidence {
        is_named: named || lattice.is_some() || !faulty.effects.is_empty(),
        is_missing: options.rule == Rule::Protocol && (has_gap || has_refused(&contests)),
        is_left: is_left || closed.is_some_and(|closed| closed.share < 0.0),
        upper_noise,
        tolerance_noise: options
            .tolerance_counts
            .zip(floor.rms_counts())
            .map_or(0.0, |(tolerance, noise)| tolerance / noise),
    };
    let verdict = evidence.verdict();
    let given_up = given_up(exchanged, &contests, &tentative, &steps);
    let leaves = Leaves { verdict, is_left, grown: &grown, of_grown: &of_grown, given_up: &given_up };
    let Drafting { draft, model: with_draft } = drafted(prepared, search, &leaves, floor)?;
    let noise_counts = floor.rms_counts().unwrap_or(0.0);
    let levels = [base_level, grown_level].map(|level| level.heldout_rms_counts);
    let staircase = search.staircase(&grown, levels, &steps, draft.as_ref())?;

    let mut not_shown = lacking;
    not_shown.extend(first.map_or_else(Vec::new, |round| not_shown::out_of_sight(&round.reach)));
    let mut effects = grown.parameters.effects()?;
    if let Some((step_counts, p_value)) = lattice {
        effects.push(Effect::new("quantisation", [("step_counts", *step_counts)])?);
        steps.push(coarse(*step_counts, *p_value, grown_level.heldout_rms_counts));
    }
    let pairs = if named { undecided(&equivalent, &grown) } else { Vec::new() };
    search.reporter.enter_planning(pairs.len() + usize::from(with_draft.is_some()));
    let plan = prepared.planner(experiments, options).plan(Open {
        pairs: &pairs,
        not_shown: &not_shown,
        at: &grown.parameters,
        draft: with_draft.as_ref(),
        lacks_repeats: verdict == Verdict::CannotJudge,
    })?;

    let is_clean = matches!(verdict, Verdict::NothingMissing | Verdict::CannotJudge);
    let share = share_unexplained(verdict, named || lattice.is_some(), share);
    let mut warnings = prepared.warnings.clone();
    warnings.extend(prepared.not_judged(&of_grown, floor));
    warnings.extend(few_presses(&agreed));
    Ok(Discovery {
        not_shown,
        warnings,
        floor,
        global: Some(GlobalTest { statistic: before.statistic, p_value }),
        curves: search.curves(&base, &grown)?,
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
        unexplained: if is_left && !is_clean {
            Unexplained {
                depends_on: depends_on(&after, [scatters[1], noise_of_grown]),
                gap: after.gap.clone(),
                share,
            }
        } else {
            Unexplained { depends_on: Vec::new(), gap: Vec::new(), share }
        },
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

/// Effects that were fitted and are not in the model with these steps, and why.
fn given_up(
    exchanged: Vec<GivenUp>,
    contests: &[Contest],
    tentative: &[AddedEffect],
    steps: &[AddedEffect],
) -> Vec<GivenUp> {
    let unconfirmed =
        tentative.iter().map(|step| GivenUp { effect: step.effect, because: Because::Unconfirmed });
    let all = exchanged.into_iter().chain(contests.iter().filter_map(Contest::given_up)).chain(unconfirmed);
    let present: Vec<&str> = steps.iter().map(|step| step.effect).collect();
    last_words(all.collect(), &present)
}

/// A warning if effects are confirmed by all of too few blocks.
fn few_presses(agreed: &[&str]) -> Option<String> {
    let names = agreed.join(" and ");
    (!agreed.is_empty()).then(|| {
        format!(
            "the presses are few: all their independent blocks agree with {names}, but they are too few for a probability of {CONFIRMED_P}"
        )
    })
}

/// True if a class lost against a rival: it was fitted because a test of the effects rejects the model without it.
fn has_refused(contests: &[Contest]) -> bool {
    contests.iter().any(|contest| !contest.kept)
}

/// Tests of a model: by effects, by covariates, of the scatter, and of the noise that should be each reading's own.
const TESTS: usize = 4;

/// The least p-value of a model's tests, corrected.
fn least_p_value(of_tests: [f64; TESTS]) -> f64 {
    of_tests.into_iter().map(corrected).fold(1.0, f64::min)
}

/// A test's p-value by Bonferroni's correction.
fn corrected(p_value: f64) -> f64 {
    (TESTS as f64 * p_value).min(1.0)
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
    let of_base = prepared.held(&prepared.base.parameters)?;
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

/// What the verdict depends on.
#[derive(Debug, Clone, Copy)]
struct Evidence {
    /// Effects were added and not withdrawn.
    is_named: bool,
    /// A test rejects the base model.
    is_missing: bool,
    /// A test rejects the grown model, or it is further from the held-out presses than the base model.
    is_left: bool,
    /// Upper bound of what is structured in the grown model's residual.
    upper_noise: f64,
    /// The tolerance that was declared beforehand; 0 if none was.
    tolerance_noise: f64,
}

impl Evidence {
    fn verdict(self) -> Verdict {
        let is_seen = self.upper_noise < SEEN_NOISE;
        let is_little = self.upper_noise < LITTLE_NOISE.max(self.tolerance_noise);
        match (self.is_named, self.is_missing) {
            (false, false) if is_seen => Verdict::NothingMissing,
            // No test rejects, but there may be more than one would overlook.
            (false, false) => Verdict::CannotJudge,
            (false, true) => Verdict::Unexplained,
            (true, _) if is_little || is_seen && !self.is_left => Verdict::Explained,
            (true, _) => Verdict::PartlyExplained,
        }
    }
}

/// The added effect for a converter that is coarser than declared.
fn coarse(step_counts: f64, p_value: f64, heldout_rms_counts: f64) -> AddedEffect {
    AddedEffect {
        effect: "quantisation",
        terms: vec![vec![Estimated { name: "step_counts", value: step_counts, standard_error: None }]],
        p_value,
        q_value: p_value,
        folds_p_value: p_value,
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
        of_base: &HeldOutResidual,
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
        let [closed, _] = self.problem.heldout_gain(base, grown);
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
                    let part = later
                        .iter()
                        .fold(grown.parameters.clone(), |part, name| without(&part, name, self.known_terms));
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

    /// The added effects, those of faulty elements included, each name once. `with_silent` is the problem in which dead and stuck elements
    /// have a weight.
    pub(crate) fn steps(
        &self,
        grown: &Fitted,
        equivalent: &Equivalent,
        refuted: &Refuted,
        with_silent: &Problem<'_>,
    ) -> Result<Vec<Step>, DiscoverError> {
        let known_terms = self.problem.predictor.known.effects.len();
        let names = names(&grown.parameters, known_terms);
        let mut of_grown: BTreeMap<FoldsOf, Option<Vec<f64>>> = BTreeMap::new();
        let mut steps = Vec::new();
        for name in names {
            let problem = if name == MISWIRED { with_silent } else { self.problem };
            let less = without(&grown.parameters, name, known_terms);
            let held = equivalent.get(name).map(|alike| &alike.without);
            let before = match held.filter(|held| held.parameters.has_terms_like(&less)) {
                Some(held) => held.clone(),
                None => problem.fit_from(less, POLISH_ROUNDS)?,
            };
            let gains = problem.heldout_gains(&before.predicted, &grown.predicted);
            let terms = grown.parameters.terms.iter().zip(&grown.errors).skip(known_terms);
            let estimated = |(term, errors): (&Term, &Vec<f64>)| {
                term.definition
                    .parameters
                    .iter()
                    .zip(&term.values)
                    .zip(errors)
                    .enumerate()
                    .filter(|(parameter, ((known, value), _))| {
                        // Beside a table, the others stay neutral.
                        term.acts(*parameter)
                            && (term.tables.is_empty() || value.to_bits() != known.neutral.to_bits())
                    })
                    .map(|(_, ((known, value), error))| Estimated {
                        name: known.name,
                        value: *value,
                        // An error greater than the range means that the data do not determine it.
                        standard_error: Some(*error)
                            .filter(|error| *error <= known.range[1] - known.range[0]),
                    })
                    .collect()
            };
            let curves = fitted_curves(grown, known_terms, name, refuted.get(name));
            let p_value = sign_flip_p(&gains, FLIPS, self.options.seed);
            let folds = self.added(grown, name).next().map_or(FoldsOf::Presses, FoldsOf::effect);
            let of_grown = match of_grown.entry(folds) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(unknown) => unknown.insert(self.problem.left_by_folds(grown, folds)?),
            };
            let of_less = self.problem.left_by_folds(&before, folds)?;
            let by_folds = of_less.zip(of_grown.as_ref()).map(|(less, grown)| gains_by_folds(&less, grown));
            let blocks = by_folds.iter().flatten().filter(|gain| **gain != 0.0).count();
            let least_p = 0.5_f64.powf(blocks as f64);
            let added = AddedEffect {
                effect: name,
                terms: terms.filter(|(term, _)| term.definition.name == name).map(estimated).collect(),
                p_value,
                q_value: p_value,
                // Those of a random walk cannot be told: its odds alone speak for it.
                folds_p_value: by_folds.map_or(0.0, |gains| sign_flip_p(&gains, FLIPS, self.options.seed)),
                heldout_rms_before_counts: problem.heldout_rms_counts(&before.predicted),
                heldout_rms_after_counts: problem.heldout_rms_counts(&grown.predicted),
                curves,
                equivalent: equivalent
                    .get(name)
                    .into_iter()
                    .flat_map(|alike| alike.same.iter().map(|(rival, _)| *rival))
                    .collect(),
            };
            steps.push(Step { added, least_p });
        }
        let p_values: Vec<f64> = steps.iter().map(|step| step.added.p_value).collect();
        for (step, q_value) in steps.iter_mut().zip(q_values(&p_values)) {
            step.added.q_value = q_value;
        }
        Ok(steps)
    }
}

/// The free curves and the tables of an added effect, beside the formula that the data refute.
fn fitted_curves(
    grown: &Fitted,
    known_terms: usize,
    name: &str,
    refuted: Option<&RefutedFormula>,
) -> Vec<FittedCurve> {
    let terms = grown.parameters.terms.iter().zip(&grown.errors).skip(known_terms);
    let mut curves = Vec::new();
    for (term, errors) in terms.filter(|(term, _)| term.definition.name == name) {
        let mut errors = errors.iter().skip(term.values.len());
        let mut knots = |at: &[f64], values: &[f64]| -> Vec<FittedKnot> {
            let knot = |((at, value), error): ((&f64, &f64), &f64)| FittedKnot {
                at: *at,
                value: *value,
                standard_error: Some(*error).filter(|error| error.is_finite()),
            };
            at.iter().zip(values).zip(errors.by_ref()).map(knot).collect()
        };
        if let Some((curve, of)) = term.curve().zip(term.knots.as_ref()) {
            curves.push(FittedCurve {
                at: curve.at,
                of: curve.of,
                knots: knots(&of.at, &of.values),
                formula: refuted.cloned(),
            });
        }
        for (parameter, table) in &term.tables {
            curves.push(FittedCurve {
                at: table.by.name(),
                of: term.definition.parameters[*parameter].name,
                knots: knots(&table.at, &table.values),
                formula: None,
            });
        }
    }
    curves
}

#[cfg(test)]
#[path = "conclude_tests.rs"]
mod tests;
