//! A discovery for machines: `report.json`.
//!
//! The structs here are the form of the file, `tactus.discovery/1`; their fields are its keys.

use std::collections::BTreeMap;

use serde::Serialize;
use tactus_discover::{
    AddedEffect, Contest, Curve, Discovery, DraftedEffect, Estimated, FaultyElement, FittedCurve, FittedKnot,
    Floor, Gap, GivenUp, GlobalTest, Inclusion, LeftOut, Level, NextExperiment, NoDraft, OpenQuestion,
    Rivalry, Round, Stair, Structured, TriedEffect,
};
use tactus_model::Covariate;
use tactus_model::effect::{Draft, Law};
use tactus_schema::draft::stage_name;

use super::draft::status;
use super::words::{because, closed_share, flags};
use super::{ActiveRun, AmbiguousEffect, DataSource, DiscoveryReport, LabEffect, in_words};

/// Name of the form of `report.json`.
const SCHEMA: &str = "tactus.discovery/1";

/// The report as JSON, `tactus.discovery/1`.
///
/// Numbers that are not finite become `null`; the same discovery always gives the same text. The parameters of an effect
/// that acts more than once have `#2`, `#3` and so on after their names from its second term on; `terms` lists them term
/// by term.
pub fn discovery_json(report: &DiscoveryReport<'_>) -> String {
    // As a value first, because a value's numbers are finite and its keys sorted.
    let value = serde_json::json!(ReportJson::of(report));
    format!("{value:#}\n")
}

#[derive(Serialize)]
struct ReportJson<'a> {
    schema: &'static str,
    rig: &'a str,
    simulated: bool,
    data: Vec<SourceJson<'a>>,
    seed: u64,
    notes: &'a [String],
    not_shown: Vec<NotShownJson<'a>>,
    warnings: &'a [String],
    lab: Vec<LabEffectJson<'a>>,
    split: SplitJson<'a>,
    noise_rms_counts: Option<f64>,
    floor: FloorJson,
    tolerance: Option<ToleranceJson>,
    faulty: &'a [FaultyElement],
    base: LevelJson,
    global: Option<GlobalTestJson>,
    gap: Vec<GapJson<'a>>,
    curves: Vec<CurveJson<'a>>,
    elements: Vec<ElementJson>,
    rounds: Vec<RoundJson<'a>>,
    given_up: Vec<GivenUpJson<'a>>,
    staircase: Vec<StairJson<'a>>,
    steps: Vec<StepJson<'a>>,
    tentative: Vec<StepJson<'a>>,
    inclusions: Vec<InclusionJson<'a>>,
    contests: Vec<ContestJson<'a>>,
    #[serde(rename = "final")]
    grown: GrownJson,
    verdict: &'static str,
    verdict_text: String,
    unexplained: UnexplainedJson<'a>,
    draft: Option<DraftJson<'a>>,
    next_experiments: Vec<NextExperimentJson<'a>>,
    open_questions: Vec<OpenQuestionJson<'a>>,
    left_out: Vec<LeftOutJson<'a>>,
    active: Vec<ActiveRunJson<'a>>,
    active_ended: Option<&'a str>,
    settled: &'a [String],
}

#[derive(Serialize)]
struct SourceJson<'a> {
    id: &'a str,
    sha256: &'a str,
    frames: u64,
    presses: u64,
}

#[derive(Serialize)]
struct NotShownJson<'a> {
    effect: &'a str,
    reason: &'a str,
}

/// An effect of the lab's own library that was tried.
#[derive(Serialize)]
struct LabEffectJson<'a> {
    name: &'a str,
    status: &'static str,
    version: &'a str,
}

#[derive(Serialize)]
struct SplitJson<'a> {
    frames: usize,
    train_presses: usize,
    heldout_presses: usize,
    heldout_depths_mm: &'a [f64],
    heldout_coverings_mm: &'a [f64],
}

#[derive(Serialize)]
struct FloorJson {
    source: &'static str,
    interval90_counts: Option<[f64; 2]>,
    freedom: Option<f64>,
}

#[derive(Serialize)]
struct ToleranceJson {
    counts: f64,
    declared: &'static str,
}

/// Root mean squares, and the same as variances.
#[derive(Serialize)]
struct LevelJson {
    heldout_rms_counts: f64,
    heldout_rms_noise: Option<f64>,
    heldout_variance_counts2: f64,
    heldout_chi2: Option<f64>,
    structured: Option<StructuredJson>,
}

#[derive(Serialize)]
struct StructuredJson {
    of: &'static str,
    rms_noise: f64,
    upper95_noise: f64,
    rms_counts: f64,
    upper95_counts: f64,
    variance_noise2: f64,
    upper95_variance_noise2: f64,
}

#[derive(Serialize)]
struct GrownJson {
    #[serde(flatten)]
    level: LevelJson,
    shrink: Option<f64>,
    shrink_se: Option<f64>,
}

#[derive(Serialize)]
struct GlobalTestJson {
    statistic: f64,
    p_value: f64,
}

#[derive(Serialize)]
struct GapJson<'a> {
    #[serde(rename = "where")]
    place: GapPlaceJson<'a>,
    element: Option<usize>,
    effect_size: f64,
    q_value: f64,
}

#[derive(Serialize)]
struct GapPlaceJson<'a> {
    covariate: &'a str,
    unit: &'a str,
    range: [f64; 2],
}

#[derive(Serialize)]
struct CurveJson<'a> {
    covariate: &'a str,
    unit: &'a str,
    of: &'a str,
    points: Vec<PointJson>,
}

#[derive(Serialize)]
struct PointJson {
    at: f64,
    before: f64,
    after: f64,
    se: f64,
}

#[derive(Serialize)]
struct ElementJson {
    before_rms_counts: f64,
    after_rms_counts: f64,
}

#[derive(Serialize)]
struct RoundJson<'a> {
    with: &'a [&'static str],
    candidates: Vec<CandidateJson<'a>>,
    taken: Option<&'a str>,
    rival: Option<&'a str>,
}

#[derive(Serialize)]
struct CandidateJson<'a> {
    effect: &'a str,
    score: f64,
    p_value: f64,
    heldout_rms_counts: Option<f64>,
    shrink: Option<f64>,
}

#[derive(Serialize)]
struct GivenUpJson<'a> {
    effect: &'a str,
    because: String,
    /// Share of the gap that it closes on presses that its fit has not seen; null unless that is the reason.
    closed_share: Option<f64>,
}

#[derive(Serialize)]
struct StairJson<'a> {
    with: &'a str,
    heldout_rms_counts: f64,
}

#[derive(Serialize)]
struct StepJson<'a> {
    effect: &'a str,
    parameters: BTreeMap<String, EstimateJson>,
    terms: Vec<BTreeMap<&'a str, EstimateJson>>,
    p_value: f64,
    q_value: f64,
    /// Null if it was not tested.
    folds_p_value: Option<f64>,
    heldout_rms_before: f64,
    heldout_rms_after: f64,
    /// `formula`, `knots`, or `table` if only parameters are free.
    form: &'static str,
    knots: Option<KnotsJson<'a>>,
    tables: Vec<TableJson<'a>>,
    /// Parameters at the end of their range or hardly determined, a sentence each.
    flags: Vec<String>,
    equivalent: &'a [&'static str],
}

/// A free curve; the keys of places and values are those of the model file.
#[derive(Serialize)]
struct KnotsJson<'a> {
    at: &'a str,
    of: &'a str,
    points: Vec<KnotJson>,
    heldout_rms_formula: Option<f64>,
}

/// A parameter that differs with where the tip stands or with time, as the model file has it.
#[derive(Serialize)]
struct TableJson<'a> {
    parameter: &'a str,
    by: &'a str,
    points: Vec<KnotJson>,
}

#[derive(Serialize)]
struct KnotJson {
    at: f64,
    value: f64,
    se: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    formula: Option<f64>,
}

#[derive(Serialize)]
struct ContestJson<'a> {
    effect: &'a str,
    ln_odds: f64,
    rivals: Vec<RivalryJson<'a>>,
    classes: Vec<InPlaceJson<'a>>,
    left_ln_odds: f64,
    kept: bool,
}

#[derive(Serialize)]
struct InPlaceJson<'a> {
    effect: &'a str,
    ln_odds: f64,
}

#[derive(Serialize)]
struct RivalryJson<'a> {
    rival: &'a str,
    instead_ln_odds: Option<f64>,
    beside_ln_odds: Option<f64>,
}

#[derive(Serialize)]
struct InclusionJson<'a> {
    effect: &'a str,
    probability: f64,
}

#[derive(Serialize)]
struct EstimateJson {
    value: f64,
    se: Option<f64>,
}

#[derive(Serialize)]
struct UnexplainedJson<'a> {
    depends_on: &'a [&'static str],
    gap: Vec<GapJson<'a>>,
    share: f64,
}

/// The draft, or why there is none.
#[derive(Serialize)]
#[serde(untagged)]
enum DraftJson<'a> {
    Found(Box<DraftedJson<'a>>),
    None { none_because: String },
}

#[derive(Serialize)]
struct DraftedJson<'a> {
    name: &'a str,
    status: &'static str,
    sentence: &'a str,
    stage: &'static str,
    carrier: &'static str,
    when: &'static str,
    covariates: Vec<GapPlaceJson<'a>>,
    law: &'static str,
    numbers: BTreeMap<&'static str, f64>,
    at: Option<&'a [Vec<f64>]>,
    values: Option<&'a [f64]>,
    weights: Option<&'a [f64]>,
    knots: Vec<KnotJson>,
    p_value: f64,
    ln_odds: f64,
    folds: usize,
    nearest: Vec<NearestJson<'a>>,
    alike: &'a [String],
    closed_share: Option<f64>,
    closed_share_se: Option<f64>,
    heldout_rms_before: f64,
    heldout_rms_after: f64,
}

#[derive(Serialize)]
struct NearestJson<'a> {
    effect: &'a str,
    ln_odds_behind: f64,
}

#[derive(Serialize)]
struct NextExperimentJson<'a> {
    experiment: &'a str,
    parameters: BTreeMap<&'a str, &'a str>,
    seed: u64,
    duration_s: f64,
    separates: &'a [String; 2],
    expected_z: Option<f64>,
}

#[derive(Serialize)]
struct OpenQuestionJson<'a> {
    separates: &'a [String; 2],
    best: Option<NextExperimentJson<'a>>,
}

#[derive(Serialize)]
struct LeftOutJson<'a> {
    experiment: &'a str,
    parameters: BTreeMap<&'a str, &'a str>,
    reason: &'a str,
}

#[derive(Serialize)]
struct ActiveRunJson<'a> {
    experiment: &'a str,
    parameters: BTreeMap<&'a str, &'a str>,
    recording: &'a str,
    duration_s: f64,
    separates: &'a [String; 2],
    expected_z: Option<f64>,
    before_equivalent: Vec<AmbiguousEffectJson<'a>>,
    after_equivalent: Vec<AmbiguousEffectJson<'a>>,
}

#[derive(Serialize)]
struct AmbiguousEffectJson<'a> {
    effect: &'a str,
    equivalent: &'a [&'static str],
}

impl<'a> ReportJson<'a> {
    fn of(report: &DiscoveryReport<'a>) -> Self {
        let found: &'a Discovery = report.discovery;
        let not_shown = found.not_shown.iter();
        let elements = found.elements.iter();
        Self {
            schema: SCHEMA,
            rig: report.rig,
            simulated: report.simulated,
            data: report.data.iter().map(SourceJson::of).collect(),
            seed: found.seed,
            notes: report.notes,
            not_shown: not_shown
                .map(|one| NotShownJson { effect: one.effect, reason: &one.reason })
                .collect(),
            warnings: &found.warnings,
            lab: report.lab.iter().map(LabEffectJson::of).collect(),
            split: SplitJson {
                frames: found.split.frames,
                train_presses: found.split.train_presses,
                heldout_presses: found.split.heldout_presses,
                heldout_depths_mm: &found.split.heldout_depths_mm,
                heldout_coverings_mm: &found.split.heldout_coverings_mm,
            },
            noise_rms_counts: found.floor.rms_counts(),
            floor: FloorJson::of(found.floor),
            tolerance: found.tolerance_counts.map(ToleranceJson::of),
            faulty: &found.faulty,
            base: LevelJson::of(found.base, found.floor),
            global: found.global.map(GlobalTestJson::of),
            gap: found.gap.iter().map(GapJson::of).collect(),
            curves: found.curves.iter().map(CurveJson::of).collect(),
            elements: elements
                .map(|element| ElementJson {
                    before_rms_counts: element.before_rms_counts,
                    after_rms_counts: element.after_rms_counts,
                })
                .collect(),
            rounds: found.rounds.iter().map(RoundJson::of).collect(),
            given_up: found.given_up.iter().map(GivenUpJson::of).collect(),
            staircase: found.staircase.iter().map(StairJson::of).collect(),
            steps: found.steps.iter().map(|step| StepJson::of(found, step)).collect(),
            tentative: found.tentative.iter().map(|step| StepJson::of(found, step)).collect(),
            inclusions: found.inclusions.iter().map(InclusionJson::of).collect(),
            contests: found.contests.iter().map(ContestJson::of).collect(),
            grown: GrownJson {
                level: LevelJson::of(found.final_.level, found.floor),
                shrink: found.final_.closed.map(|closed| closed.share),
                shrink_se: found.final_.closed.and_then(|closed| closed.standard_error),
            },
            verdict: found.verdict.name(),
            verdict_text: in_words(found),
            unexplained: UnexplainedJson {
                depends_on: &found.unexplained.depends_on,
                gap: found.unexplained.gap.iter().map(GapJson::of).collect(),
                share: found.unexplained.share,
            },
            draft: found.draft.as_ref().map(DraftJson::of),
            next_experiments: found.plan.next.iter().map(NextExperimentJson::of).collect(),
            open_questions: found.plan.open.iter().map(OpenQuestionJson::of).collect(),
            left_out: found.plan.left_out.iter().map(LeftOutJson::of).collect(),
            active: report.active.iter().map(ActiveRunJson::of).collect(),
            active_ended: report.active_ended,
            settled: report.settled,
        }
    }
}

impl<'a> DraftJson<'a> {
    fn of(draft: &'a Result<Box<DraftedEffect>, NoDraft>) -> Self {
        match draft {
            Ok(found) => Self::Found(Box::new(DraftedJson::of(found))),
            Err(none) => Self::None { none_because: none.in_words() },
        }
    }
}

impl<'a> DraftedJson<'a> {
    fn of(found: &'a DraftedEffect) -> Self {
        let draft = &found.draft;
        let table = if let Law::Table { at, values } = &draft.law { Some((at, values)) } else { None };
        let (at, values) = table.map(|(at, values)| (at.as_slice(), values.as_slice())).unzip();
        let place = |(covariate, range): (&Covariate, &[f64; 2])| GapPlaceJson {
            covariate: covariate.name(),
            unit: covariate.unit(),
            range: *range,
        };
        let formula = |at: f64| at_knots(draft).then(|| draft.law.value(&[at]));
        let knot = |[at, value, se]: &[f64; 3]| KnotJson {
            at: *at,
            value: *value,
            se: Some(*se).filter(|se| se.is_finite()),
            formula: formula(*at),
        };
        Self {
            name: &draft.name,
            status: status(found).name(),
            sentence: &draft.sentence,
            stage: stage_name(draft.stage()),
            carrier: draft.carrier.name(),
            when: draft.when.name(),
            covariates: draft.covariates.iter().zip(&draft.ranges).map(place).collect(),
            law: draft.law.name(),
            numbers: draft.law.numbers().into_iter().collect(),
            at,
            values,
            weights: draft.weights.as_deref(),
            knots: found.knots.iter().map(knot).collect(),
            p_value: found.p_value,
            ln_odds: found.ln_odds,
            folds: found.folds,
            nearest: found
                .nearest
                .iter()
                .map(|(effect, behind)| NearestJson { effect, ln_odds_behind: *behind })
                .collect(),
            alike: &found.alike,
            closed_share: found.closed.map(|closed| closed.share),
            closed_share_se: found.closed.and_then(|closed| closed.standard_error),
            heldout_rms_before: found.heldout_rms_before_counts,
            heldout_rms_after: found.heldout_rms_after_counts,
        }
    }
}

/// True if a law passes through the knots of the draft's curve.
fn at_knots(draft: &Draft) -> bool {
    !matches!(draft.law, Law::Table { .. })
}

impl<'a> SourceJson<'a> {
    fn of(source: &'a DataSource) -> Self {
        Self { id: &source.id, sha256: &source.sha256, frames: source.frames, presses: source.presses }
    }
}

impl FloorJson {
    fn of(floor: Floor) -> Self {
        Self {
            source: floor.source(),
            interval90_counts: floor.interval90_counts(),
            freedom: floor.freedom(),
        }
    }
}

impl ToleranceJson {
    fn of(counts: f64) -> Self {
        Self { counts, declared: "beforehand" }
    }
}

impl LevelJson {
    fn of(level: Level, floor: Floor) -> Self {
        let noise_counts = floor.rms_counts();
        let structured = level.structured.zip(noise_counts);
        Self {
            heldout_rms_counts: level.heldout_rms_counts,
            heldout_rms_noise: noise_counts.map(|noise| level.heldout_rms_counts / noise),
            heldout_variance_counts2: level.heldout_rms_counts.powi(2),
            heldout_chi2: level.heldout_chi2,
            structured: structured.map(|(part, noise)| StructuredJson::of(part, noise)),
        }
    }
}

impl StructuredJson {
    fn of(part: Structured, noise_counts: f64) -> Self {
        Self {
            of: if part.with_signal { "readings with a signal" } else { "all readings" },
            rms_noise: part.rms_noise,
            upper95_noise: part.upper_noise,
            rms_counts: part.rms_noise * noise_counts,
            upper95_counts: part.upper_noise * noise_counts,
            variance_noise2: part.rms_noise.powi(2),
            upper95_variance_noise2: part.upper_noise.powi(2),
        }
    }
}

impl GlobalTestJson {
    fn of(GlobalTest { statistic, p_value }: GlobalTest) -> Self {
        Self { statistic, p_value }
    }
}

impl<'a> LabEffectJson<'a> {
    fn of(LabEffect { name, status, version }: &'a LabEffect) -> Self {
        Self { name, status: status.name(), version }
    }
}

impl<'a> GapJson<'a> {
    fn of(gap: &'a Gap) -> Self {
        Self {
            place: GapPlaceJson { covariate: gap.covariate, unit: gap.unit, range: gap.range },
            element: gap.element,
            effect_size: gap.effect_size,
            q_value: gap.q_value,
        }
    }
}

impl<'a> CurveJson<'a> {
    fn of(curve: &'a Curve) -> Self {
        let points = curve.points.iter().map(|point| PointJson {
            at: point.at,
            before: point.before,
            after: point.after,
            se: point.standard_error,
        });
        Self { covariate: curve.covariate, unit: curve.unit, of: curve.of, points: points.collect() }
    }
}

impl<'a> RoundJson<'a> {
    fn of(round: &'a Round) -> Self {
        Self {
            with: &round.with,
            candidates: round.candidates.iter().map(CandidateJson::of).collect(),
            taken: round.taken,
            rival: round.rival,
        }
    }
}

impl<'a> GivenUpJson<'a> {
    fn of(one: &'a GivenUp) -> Self {
        Self { effect: one.effect, because: because(one), closed_share: closed_share(one) }
    }
}

impl<'a> StairJson<'a> {
    fn of(stair: &'a Stair) -> Self {
        Self { with: &stair.with, heldout_rms_counts: stair.heldout_rms_counts }
    }
}

impl<'a> CandidateJson<'a> {
    fn of(candidate: &'a TriedEffect) -> Self {
        Self {
            effect: candidate.effect,
            score: candidate.score,
            p_value: candidate.p_value,
            heldout_rms_counts: candidate.heldout_rms_counts,
            shrink: candidate.shrink,
        }
    }
}

impl<'a> InclusionJson<'a> {
    fn of(Inclusion { effect, probability }: &'a Inclusion) -> Self {
        Self { effect, probability: *probability }
    }
}

impl<'a> ContestJson<'a> {
    fn of(contest: &'a Contest) -> Self {
        // A rival that gains nothing has no odds.
        let known = |ln_odds: f64| Some(ln_odds).filter(|ln_odds| ln_odds.is_finite());
        let rivalry = |one: &'a Rivalry| RivalryJson {
            rival: one.rival,
            instead_ln_odds: known(one.instead),
            beside_ln_odds: known(one.beside),
        };
        Self {
            effect: contest.effect,
            ln_odds: contest.ln_odds,
            rivals: contest.rivals.iter().map(rivalry).collect(),
            classes: contest
                .classes
                .iter()
                .map(|(effect, ln_odds)| InPlaceJson { effect, ln_odds: *ln_odds })
                .collect(),
            left_ln_odds: contest.left,
            kept: contest.kept,
        }
    }
}

impl<'a> StepJson<'a> {
    fn of(found: &Discovery, step: &'a AddedEffect) -> Self {
        let numbered = step.terms.iter().enumerate().flat_map(|(nth, term)| {
            let suffix = if nth == 0 { String::new() } else { format!("#{}", nth + 1) };
            term.iter().map(move |one| (format!("{}{suffix}", one.name), EstimateJson::of(one)))
        });
        let term = |term: &'a Vec<Estimated>| term.iter().map(|one| (one.name, EstimateJson::of(one)));
        let knots = step.curves.iter().find(|curve| !curve.is_table()).map(KnotsJson::of);
        let tables: Vec<_> = step.curves.iter().filter(|curve| curve.is_table()).map(TableJson::of).collect();
        Self {
            effect: step.effect,
            parameters: numbered.collect(),
            terms: step.terms.iter().map(|one| term(one).collect()).collect(),
            p_value: step.p_value,
            q_value: step.q_value,
            folds_p_value: step.folds_p_value,
            heldout_rms_before: step.heldout_rms_before_counts,
            heldout_rms_after: step.heldout_rms_after_counts,
            form: if knots.is_some() {
                "knots"
            } else if tables.is_empty() {
                "formula"
            } else {
                "table"
            },
            knots,
            tables,
            flags: flags(found, step),
            equivalent: &step.equivalent,
        }
    }
}

impl<'a> KnotsJson<'a> {
    fn of(curve: &'a FittedCurve) -> Self {
        let formula = curve.formula.as_ref();
        Self {
            at: curve.at,
            of: curve.of,
            points: KnotJson::all(curve),
            heldout_rms_formula: formula.map(|formula| formula.heldout_rms_counts),
        }
    }
}

impl<'a> TableJson<'a> {
    fn of(table: &'a FittedCurve) -> Self {
        Self { parameter: table.of, by: table.at, points: KnotJson::all(table) }
    }
}

impl KnotJson {
    fn all(curve: &FittedCurve) -> Vec<Self> {
        let formula = |nth: usize| Some(curve.formula.as_ref()?.values[nth]);
        let knot = |(nth, knot): (usize, &FittedKnot)| Self {
            at: knot.at,
            value: knot.value,
            se: knot.standard_error,
            formula: formula(nth),
        };
        curve.knots.iter().enumerate().map(knot).collect()
    }
}

impl EstimateJson {
    fn of(parameter: &Estimated) -> Self {
        Self { value: parameter.value, se: parameter.standard_error }
    }
}

impl<'a> NextExperimentJson<'a> {
    fn of(next: &'a NextExperiment) -> Self {
        Self {
            experiment: &next.experiment,
            parameters: by_name(&next.parameters),
            seed: next.seed,
            duration_s: next.duration_s,
            separates: &next.separates,
            expected_z: next.expected_z,
        }
    }
}

impl<'a> OpenQuestionJson<'a> {
    fn of(question: &'a OpenQuestion) -> Self {
        Self { separates: &question.separates, best: question.best.as_ref().map(NextExperimentJson::of) }
    }
}

impl<'a> LeftOutJson<'a> {
    fn of(one: &'a LeftOut) -> Self {
        Self { experiment: &one.experiment, parameters: by_name(&one.parameters), reason: &one.reason }
    }
}

impl<'a> ActiveRunJson<'a> {
    fn of(run: &'a ActiveRun) -> Self {
        Self {
            experiment: &run.experiment,
            parameters: by_name(&run.parameters),
            recording: &run.recording,
            duration_s: run.duration_s,
            separates: &run.separates,
            expected_z: run.expected_z,
            before_equivalent: run.before.iter().map(AmbiguousEffectJson::of).collect(),
            after_equivalent: run.after.iter().map(AmbiguousEffectJson::of).collect(),
        }
    }
}

impl<'a> AmbiguousEffectJson<'a> {
    fn of(undecided: &'a AmbiguousEffect) -> Self {
        Self { effect: undecided.effect, equivalent: &undecided.equivalent }
    }
}

fn by_name<'a>(parameters: &'a [(&'static str, String)]) -> BTreeMap<&'a str, &'a str> {
    parameters.iter().map(|(name, value)| (*name, value.as_str())).collect()
}
