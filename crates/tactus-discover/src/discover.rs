//! The protocol: recalibrate, test, locate, name, add, and again.

use std::collections::BTreeMap;
use std::sync::Mutex;

use tactus_model::{Array, Effect, EffectError, Indenter, ModelError, Psf, Registration, Response};

use crate::candidates::{Candidate, Hints};
use crate::covariates::{Feature, Form, Forms, features};
use crate::discovery::{
    Base, Curve, Discovery, ElementGap, Estimated, Final, Gap, GlobalTest, Level, Point, Split, Step, Unexplained, Verdict,
};
use crate::fit::{Fitted, Problem};
use crate::next::{Explanation, Setting};
use crate::noise::Noise;
use crate::rows::{HeldOut, Rows, still};
use crate::score::{Score, flipped, p_value, q_values};
use crate::search::{ALPHA, Equivalent, Search, largest, names, without};
use crate::sensor::{Parameters, Sensor};
use crate::{Frames, lattice, not_shown, parallel, spectrum, wiring};

/// What is known before: the model that the data are held against.
#[derive(Debug, Clone)]
pub struct Known {
    /// The elements.
    pub array: Array,
    /// The declared spread.
    pub psf: Psf,
    /// The declared response.
    pub response: Response,
    /// Where the sensor is taken to lie.
    pub registration: Registration,
    /// The tools, by id.
    pub indenters: BTreeMap<String, Indenter>,
    /// Effects that are known already; they are fitted anew with the rest, and stay.
    pub effects: Vec<Effect>,
}

/// How to go about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// The seed of the split and of the Monte-Carlo tests.
    pub seed: u64,
    /// How many threads may compute.
    pub threads: usize,
}

/// How far it has come.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// What is being done, such as `round 2: fitting hysteresis`.
    pub what: String,
    /// Share of the whole that is done, as far as that can be known; never falls.
    pub share: f64,
}

/// Why nothing could be found out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DiscoverError {
    /// There are too few frames to say anything.
    #[error("{0}")]
    TooLittle(String),
    /// The declared parameters make no model.
    #[error("the declared model: {0}")]
    Model(#[from] ModelError),
    /// A known effect does not fit the array.
    #[error("the declared model: {0}")]
    Effect(#[from] EffectError),
}

/// Follows the whole protocol.
///
/// # Errors
/// [`DiscoverError`].
pub fn discover(
    known: &Known,
    frames: &Frames,
    options: Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Discovery, DiscoverError> {
    let said = Said { progress, share: Mutex::new(0.0) };
    let mut warnings = Vec::new();
    let still = still(frames);
    let heldout = HeldOut::choose(frames, options.seed);
    if heldout.train_presses < PRESSES_LEAST {
        return Err(DiscoverError::TooLittle(format!(
            "{} presses can be fitted; at least {PRESSES_LEAST} are needed, and half as many to hold out",
            heldout.train_presses
        )));
    }
    let lattice = lattice::wider_step(frames, known.array.step_counts());
    let step_counts = lattice.map_or(known.array.step_counts(), |(step_counts, _)| step_counts);
    let replicated = Noise::of(frames, &still, step_counts);
    let noise = match &replicated {
        Some(noise) => noise.clone(),
        None => {
            warnings.push(
                "no frames repeat each other: the noise is estimated from differences of consecutive frames"
                    .into(),
            );
            Noise::of_differences(frames, step_counts)
        }
    };
    said.say("recalibrating the base model", 0.02);

    let whole = Rows::of(frames, false)?;
    let thin = Rows::of(frames, true)?;
    let (hints, rows) = {
        let mut rows = thin;
        rows.weigh(frames, &noise, &heldout);
        let problem = Problem::new(Sensor::new(known, frames, &rows), &noise);
        let base =
            problem.fit_from(Parameters::declared(known, rows.paths.len()), 12, options.threads)?;
        let of_frames = Sensor::new(known, frames, &whole).predict(&base.parameters)?;
        let residual: Vec<f64> =
            frames.counts.iter().zip(&of_frames).map(|(counts, of)| f64::from(*counts) - of).collect();
        let frequencies_hz = spectrum::lines_hz(frames, &residual);
        let wiring = wiring::pairs(&problem, &base);
        // A tone is lost in rows of several frames.
        let rows = if frequencies_hz.is_empty() {
            rows
        } else {
            let mut rows = Rows::of(frames, false)?;
            rows.weigh(frames, &noise, &heldout);
            rows
        };
        (Hints { frequencies_hz, wiring }, rows)
    };
    let problem = Problem::new(Sensor::new(known, frames, &rows), &noise);
    let base = problem.fit_from(Parameters::declared(known, rows.paths.len()), 12, options.threads)?;
    said.say("scoring the effects", 0.1);
    let candidates = Candidate::all(&problem, &base.parameters, &base.predicted, &hints)?;
    let base_gap = problem.heldout_gap(&base.predicted);
    let search = Search {
        problem: &problem,
        candidates: &candidates,
        options,
        known_terms: known.effects.len(),
        base_gap: base_gap.value,
        base_cost: base.cost,
        progress: &|what| said.say(what, 0.0),
    };
    let before = search.locate(&base)?;
    let (grown, rounds) = search.forward(base.clone())?;
    // Two tests, each at half the chance.
    let first = rounds.first();
    let any = (2.0 * first.map_or(1.0, |round| round.p_value).min(before.p_value)).min(1.0);
    let not_shown = first.map_or_else(Vec::new, |round| {
        not_shown::not_shown(&problem, &round.screened, replicated.is_some())
    });
    said.say("taking back what does not earn its place", 0.6);
    let mut grown = search.back(grown)?;
    let mut equivalent = Equivalent::new();
    if !names(&grown.parameters, search.known_terms).is_empty() {
        said.say("trying every other effect in each one's place", 0.7);
        (grown, equivalent) = search.exchange(grown)?;
        grown = search.back(grown)?;
    }
    said.say("what is left", 0.9);
    let after = search.locate(&grown)?;
    let grown_gap = problem.heldout_gap(&grown.predicted);
    let [closed, _] = problem.heldout_gain(&base, &grown);
    // What is left beyond the doubt about the noise, of what there was.
    let sure = grown_gap.sure();
    let share = if closed + sure > 0.0 { (sure / (closed + sure)).clamp(0.0, 1.0) } else { 1.0 };
    let left = after.p_value <= ALPHA;
    if left && (share > UNEXPLAINED_SHARE || after.statistic > LEFT_Z.max(LEFT_SHARE * before.statistic)) {
        // A model that leaves so much is none of what it is named after.
        grown = base.clone();
    }
    let found = !names(&grown.parameters, search.known_terms).is_empty();
    let verdict = match (found || lattice.is_some(), any <= ALPHA) {
        (false, false) => Verdict::NothingMissing,
        (false, true) => Verdict::Unexplained,
        (true, _) if share <= EXPLAINED_SHARE || !left => Verdict::Explained,
        (true, _) => Verdict::PartlyExplained,
    };
    let (level_base, elements_before, _) = of_frames(&whole, known, frames, &heldout, &noise, &base.parameters)?;
    let (level_grown, elements_after, residual) =
        of_frames(&whole, known, frames, &heldout, &noise, &grown.parameters)?;
    // A tone looks like noise until it is known.
    let floor = Noise::of_residual(frames, &residual, &still, step_counts)
        .map_or(noise.rms_counts, |noise| noise.rms_counts.min(replicated.as_ref().map_or(noise.rms_counts, |raw| raw.rms_counts)));
    let in_noise = |level: Level| Level { heldout_chi2: (level.heldout_rms_counts / floor).powi(2), ..level };
    let (level_base, level_grown) = (in_noise(level_base), in_noise(level_grown));
    let gap_counts2 = level_base.heldout_rms_counts.powi(2) - floor.powi(2);
    let closed = level_base.heldout_rms_counts.powi(2) - level_grown.heldout_rms_counts.powi(2);
    let curves = search.curves(&base, &grown)?;
    let mut steps = search.steps(&grown, &equivalent)?;
    let mut effects = grown.parameters.effects()?;
    if let Some((step_counts, p_value)) = lattice {
        effects.push(Effect::new("quantisation", [("step_counts", step_counts)])?);
        steps.push(Step {
            effect: "quantisation",
            terms: vec![vec![Estimated { name: "step_counts", value: step_counts, standard_error: None }]],
            p_value,
            q_value: p_value,
            heldout_rms_before_counts: level_grown.heldout_rms_counts,
            heldout_rms_after_counts: level_grown.heldout_rms_counts,
            equivalent: Vec::new(),
        });
    }
    said.say("planning what to measure next", 0.95);
    let explained = |name: &str, fitted: &Fitted| Explanation {
        name: name.to_owned(),
        parameters: fitted.parameters.clone(),
    };
    let pairs: Vec<[Explanation; 2]> = equivalent
        .iter()
        .filter(|_| found)
        .flat_map(|(name, rivals)| {
            rivals.iter().map(|(rival, fitted)| [explained(name, &grown), explained(rival, fitted)])
        })
        .collect();
    let setting = Setting { known, frames, noise: &noise, threads: options.threads };
    let mut next_experiments = setting.propose(&pairs)?;
    next_experiments.extend(setting.show(&not_shown, &grown.parameters)?);
    said.say("done", 1.0);
    Ok(Discovery {
        seed: options.seed,
        not_shown,
        warnings,
        split: Split {
            frames: frames.len(),
            train_presses: heldout.train_presses,
            heldout_presses: heldout.presses,
            heldout_depths_mm: heldout.depths_mm,
            heldout_coverings_mm: heldout.coverings_mm,
        },
        heldout_frames: heldout.frames.clone(),
        noise_rms_counts: replicated.map(|_| floor),
        base: level_base,
        global: GlobalTest { statistic: before.statistic, p_value: any },
        gap: before.gap,
        curves,
        elements: elements_before
            .into_iter()
            .zip(elements_after)
            .map(|(before_rms_counts, after_rms_counts)| ElementGap { before_rms_counts, after_rms_counts })
            .collect(),
        rounds: rounds.into_iter().map(|tried| tried.round).collect(),
        steps,
        final_: Final {
            level: level_grown,
            shrink: (any <= ALPHA && gap_counts2 > 0.0).then(|| closed / gap_counts2),
        },
        verdict,
        unexplained: Unexplained {
            depends_on: if left && any <= ALPHA { after.gap.iter().map(|gap| gap.covariate).collect() } else { Vec::new() },
            share: match verdict {
                Verdict::NothingMissing => 0.0,
                Verdict::Unexplained => 1.0,
                Verdict::Explained | Verdict::PartlyExplained => share,
            },
        },
        next_experiments,
        recalibrated: base_of(known, &base.parameters),
        effects,
        grown: base_of(known, &grown.parameters),
    })
}

/// Where a model and the data disagree.
struct Located {
    statistic: f64,
    p_value: f64,
    gap: Vec<Gap>,
}

impl Search<'_> {
    /// On what the residual of a model depends.
    fn locate(&self, at: &Fitted) -> Result<Located, DiscoverError> {
        let problem = self.problem;
        let fitting = self.fitting(at)?;
        let forms = Forms::of(problem, &at.parameters, &at.predicted)?;
        let features = features(problem, &forms);
        let elements = problem.sensor.rows.elements;
        let scored = |feature: &Feature| {
            let mut column = forms.column(feature, elements);
            let readings = column.iter().filter(|value| **value != 0.0).count();
            fitting.free(&mut column);
            let z = fitting.wanted(&column) / fitting.size(&column).max(f64::MIN_POSITIVE);
            (fitting.score(&[column]), z, readings)
        };
        let scored = parallel::map(&features, self.options.threads, scored);
        let mut covariates: Vec<&'static str> = features.iter().map(|feature| feature.covariate).collect();
        covariates.dedup();
        let of = |covariate: &str| -> Vec<usize> {
            (0..features.len()).filter(|index| features[*index].covariate == covariate).collect()
        };
        let groups: Vec<Vec<&Score>> =
            covariates.iter().map(|one| of(one).iter().map(|index| &scored[*index].0).collect()).collect();
        let under_none = flipped(&groups, FLIPS, self.options.seed ^ 0x10ca_7e);
        let statistics: Vec<f64> =
            groups.iter().map(|group| group.iter().map(|score| score.z).fold(0.0, f64::max)).collect();
        let p_values: Vec<f64> =
            statistics.iter().zip(&under_none).map(|(statistic, none)| p_value(*statistic, none)).collect();
        let statistic = statistics.iter().copied().fold(0.0, f64::max);
        let mut gap: Vec<Gap> = Vec::new();
        for ((covariate, q_value), statistic) in covariates.iter().zip(q_values(&p_values)).zip(&statistics) {
            let strongest = of(covariate)
                .into_iter()
                .max_by(|a, b| scored[*a].0.z.total_cmp(&scored[*b].0.z));
            let Some(strongest) = strongest.filter(|_| q_value <= Q_MAX && *statistic > 0.0) else {
                continue;
            };
            let (_, z, readings) = &scored[strongest];
            let feature = &features[strongest];
            gap.push(Gap {
                covariate,
                unit: feature.unit,
                range: feature.range,
                effect_size: z.abs() / (*readings as f64).sqrt(),
                q_value,
            });
        }
        gap.sort_by(|a, b| b.effect_size.total_cmp(&a.effect_size));
        Ok(Located { statistic, p_value: p_value(statistic, &largest(&under_none)), gap })
    }

    /// The residual against each covariate, before and after.
    fn curves(&self, base: &Fitted, grown: &Fitted) -> Result<Vec<Curve>, DiscoverError> {
        let problem = self.problem;
        let forms = Forms::of(problem, &base.parameters, &base.predicted)?;
        let features = features(problem, &forms);
        let mut curves: Vec<Curve> = Vec::new();
        for feature in features.iter().filter(|one| matches!(one.form, Form::Signal | Form::Offset)) {
            let column = forms.column(feature, problem.sensor.rows.elements);
            let Some([before, standard_error]) = problem.share(&column, &base.predicted) else { continue };
            let Some([after, _]) = problem.share(&column, &grown.predicted) else { continue };
            let at = f64::midpoint(feature.range[0], feature.range[1]);
            let of = if feature.form == Form::Signal { "share of the signal" } else { "counts" };
            let point = Point { at, before, after, standard_error };
            let same = |curve: &&mut Curve| curve.covariate == feature.covariate && curve.of == of;
            match curves.iter_mut().find(same) {
                Some(curve) => curve.points.push(point),
                None => curves.push(Curve {
                    covariate: feature.covariate,
                    unit: feature.unit,
                    of,
                    points: vec![point],
                }),
            }
        }
        curves.retain(|curve| curve.points.len() > 1);
        Ok(curves)
    }

    /// What was added, each name once.
    fn steps(
        &self,
        grown: &Fitted,
        equivalent: &Equivalent,
    ) -> Result<Vec<Step>, DiscoverError> {
        let names = names(&grown.parameters, self.known_terms);
        let after = self.problem.heldout_blocks(&grown.predicted);
        let mut steps = Vec::new();
        for name in names {
            let less = without(&grown.parameters, name, self.known_terms);
            let before = self.problem.fit_from(less, 8, self.options.threads)?;
            let blocks = self.problem.heldout_blocks(&before.predicted);
            let gains: Vec<f64> = blocks.iter().zip(&after).map(|(b, a)| b[0] - a[0]).collect();
            let terms = grown.parameters.terms.iter().zip(&grown.errors).skip(self.known_terms);
            let estimated = |(term, errors): (&crate::sensor::Term, &Vec<f64>)| {
                term.definition
                    .parameters
                    .iter()
                    .zip(&term.values)
                    .zip(errors)
                    .map(|((known, value), error)| Estimated {
                        name: known.name,
                        value: *value,
                        standard_error: Some(*error).filter(|error| error.is_finite()),
                    })
                    .collect()
            };
            let p_value = crate::score::sign_flip_p(&gains, FLIPS, self.options.seed);
            steps.push(Step {
                effect: name,
                terms: terms.filter(|(term, _)| term.definition.name == name).map(estimated).collect(),
                p_value,
                q_value: p_value,
                heldout_rms_before_counts: self.problem.heldout_rms_counts(&before.predicted),
                heldout_rms_after_counts: self.problem.heldout_rms_counts(&grown.predicted),
                equivalent: equivalent.get(name).into_iter().flatten().map(|(rival, _)| *rival).collect(),
            });
        }
        let p_values: Vec<f64> = steps.iter().map(|step| step.p_value).collect();
        for (step, q_value) in steps.iter_mut().zip(q_values(&p_values)) {
            step.q_value = q_value;
        }
        Ok(steps)
    }
}

/// Presses that are fitted, at least.
const PRESSES_LEAST: usize = 3;
const FLIPS: usize = 1999;
/// Covariates are told with at most this share of false ones among them.
const Q_MAX: f64 = 0.05;
/// What is left of the gap at most, for the verdict.
const EXPLAINED_SHARE: f64 = 0.1;
const UNEXPLAINED_SHARE: f64 = 0.35;
/// What is left withdraws all names if it depends on a covariate so clearly, and so much of how clearly it did at first.
const LEFT_Z: f64 = 4.7;
const LEFT_SHARE: f64 = 0.35;

/// Says how far it has come; the share never falls.
struct Said<'a> {
    progress: &'a (dyn Fn(Progress) + Sync),
    share: Mutex<f64>,
}

impl Said<'_> {
    fn say(&self, what: &str, share: f64) {
        let mut held = self.share.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        // What has no share of its own goes part of the way.
        *held = if share > 0.0 { held.max(share) } else { *held + 0.01 * (1.0 - *held) };
        (self.progress)(Progress { what: what.to_owned(), share: *held });
    }
}

/// How far a model is from the held-out frames, all together and element by element.
fn of_frames(
    whole: &Rows,
    known: &Known,
    frames: &Frames,
    heldout: &HeldOut,
    noise: &Noise,
    parameters: &Parameters,
) -> Result<(Level, Vec<f64>, Vec<f32>), DiscoverError> {
    let predicted = Sensor::new(known, frames, whole).predict(parameters)?;
    let elements = frames.elements;
    let mut squares = vec![0.0; elements];
    let mut count = 0.0_f64;
    for (frame, of) in predicted.chunks_exact(elements).enumerate() {
        if heldout.frames[frame] {
            count += 1.0;
            for ((sum, counts), of) in squares.iter_mut().zip(frames.counts_of(frame)).zip(of) {
                *sum += (f64::from(*counts) - of).powi(2);
            }
        }
    }
    let count = count.max(1.0);
    let mean = squares.iter().sum::<f64>() / (count * elements as f64);
    let level = Level { heldout_rms_counts: mean.sqrt(), heldout_chi2: mean / noise.rms_counts.powi(2) };
    #[expect(clippy::cast_possible_truncation, reason = "as precise as counts are")]
    let residual = frames.counts.iter().zip(&predicted).map(|(counts, of)| counts - *of as f32).collect();
    Ok((level, squares.into_iter().map(|sum| (sum / count).sqrt()).collect(), residual))
}

fn base_of(known: &Known, parameters: &Parameters) -> Base {
    let elements = known.array.elements();
    let runs = parameters.baseline.len().max(1) as f64;
    let mean = |element: usize| parameters.baseline.iter().map(|run| run[element]).sum::<f64>() / runs;
    let response = Response {
        sensitivity_counts_per_mm: parameters.sensitivity.clone(),
        baseline_counts: (0..elements).map(mean).collect(),
        ..known.response.clone()
    };
    Base { psf: parameters.psf, response, run_baselines_counts: parameters.baseline.clone() }
}

/// What a model gives for every frame, before noise: frame by frame, element by element, in counts.
///
/// # Errors
/// [`DiscoverError`] if the parameters make no model.
pub fn predict(
    known: &Known,
    frames: &Frames,
    base: &Base,
    effects: &[Effect],
) -> Result<Vec<f32>, DiscoverError> {
    let rows = Rows::of(frames, false)?;
    let parameters = Parameters {
        sensitivity: base.response.sensitivity_counts_per_mm.clone(),
        baseline: base.run_baselines_counts.clone(),
        psf: base.psf,
        terms: effects.iter().map(crate::sensor::Term::of).collect(),
    };
    let predicted = Sensor::new(known, frames, &rows).predict(&parameters)?;
    #[expect(clippy::cast_possible_truncation, reason = "counts are stored in single precision")]
    let single = predicted.into_iter().map(|counts| counts as f32).collect();
    Ok(single)
}
