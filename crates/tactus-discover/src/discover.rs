//! The protocol: recalibrate the base model, test for structure, locate it, name the effect, add it, and repeat.

use rayon::ThreadPoolBuilder;
use tactus_model::Effect;
use tactus_model::effect::Definition;

use crate::data::{Bins, Converter, DiscoverError, Floor, Frames, Known, Rounding};
use crate::fit::{Parameters, Predictor, Prepared, RandomWalk, Term};
use crate::next::Experiments;
use crate::progress::{Progress, Reporter, Stage};
use crate::search::{Candidate, Formed, Grown, Memory, Options, Rule, Search, WORK_MOST, not_shown};
use crate::verdict::{
    BaseModel, Confirmation, Discovery, SearchOutcome, cannot_judge, conclude, confirmation, confirmed,
};

/// Turns in which a base model and what wider steps do to its counts are fitted to each other. Of a few gaps the first turn knows enough.
const STEPS_TURNS: usize = 3;

/// Finds which effects a model lacks, by the whole protocol. Next experiments are chosen from those of the rig.
///
/// # Errors
/// [`DiscoverError`] if the data do not suffice, the model is invalid or threads cannot be started.
pub fn discover(
    known: &Known,
    frames: &Frames,
    options: Options,
    experiments: &dyn Experiments,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Discovery, DiscoverError> {
    let threads = options.threads.max(1);
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| DiscoverError::Threads { threads, reason: error.to_string() })?;
    pool.install(|| discover_on_threads(known, frames, options, experiments, progress))
}

fn discover_on_threads(
    known: &Known,
    frames: &Frames,
    options: Options,
    experiments: &dyn Experiments,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Discovery, DiscoverError> {
    let reporter = Reporter::new(progress);
    reporter.enter(Stage::Base, "recalibrating the base model");
    let (converter, smooth) = without_rounding(known, frames, options.seed)?;
    let prepared = Prepared::read_by(converter, known, smooth.as_ref().unwrap_or(frames), options.seed)?;
    if prepared.floor == Floor::None {
        reporter.enter_planning(0);
        return cannot_judge(&prepared, options, experiments);
    }
    let problem = prepared.problem();
    let base = &prepared.base;
    reporter.enter(Stage::Locating, "locating where data and base model disagree");
    let lacking = not_shown::lacking(&problem, prepared.replicates);
    let mut candidates = Candidate::all(&problem, base, &prepared.lines)?;
    candidates.retain(|one| lacking.iter().all(|lacking| lacking.effect != one.definition.name));
    let search = Search {
        problem: &problem,
        candidates: &candidates,
        options,
        known_terms: known.effects.len() + prepared.faulty.effects.len(),
        rounds: prepared.rounds(),
        may_be_rounding: prepared.noise.may_be_rounding(base.cost / problem.readings()),
        work_most: WORK_MOST,
        memory: Memory::default(),
        reporter: &reporter,
    };
    let before = search.locate(base)?;
    reporter.enter(Stage::Scattering, "testing the scatter");
    let scattered = search.scattered(base)?;
    let Grown { at: grown, rounds, mut equivalent, refused, exchanged, is_cut, .. } = match options.rule {
        Rule::Protocol => search.grow(base)?,
        Rule::Bic => search.grow_by_bic(base.clone())?,
    };
    let formed = match options.rule {
        Rule::Protocol => search.formed(grown, &equivalent)?,
        Rule::Bic => Formed::from(grown),
    };
    let (formed, mut contests) = search.contested(formed, &mut equivalent)?;
    contests.extend(refused);
    let confirmed = confirmed(&prepared, &search, formed, &equivalent)?;
    let outcome = SearchOutcome {
        lacking,
        confirmed,
        rounds,
        equivalent,
        is_cut,
        contests,
        exchanged,
        before,
        scattered,
    };
    conclude(&prepared, &search, outcome, experiments)
}

/// A converter that is not as declared, and the frames less what it does to a model's counts. That model is fitted to frames without it, so that
/// each turn knows better where codes begin.
fn without_rounding(
    known: &Known,
    frames: &Frames,
    seed: u64,
) -> Result<(Option<Converter>, Option<Frames>), DiscoverError> {
    let Some(converter) = Converter::seen(frames, known.array.step_counts()) else {
        return Ok((None, None));
    };
    let rounding = Rounding::of(&converter, &frames.counts);
    let mut smooth = frames.clone();
    let turns = if converter.rounds() { STEPS_TURNS } else { 1 };
    for _ in 0..turns {
        let read = Prepared::read_by(Some(converter.clone()), known, &smooth, seed)?;
        smooth.counts = read.without(&rounding, &frames.counts)?;
    }
    Ok((Some(converter), Some(smooth)))
}

/// Compares a draft with new data: how strong it is there, and how much it closes of what a model leaves without it. The model's effects are
/// fitted again, its gains and zeros too.
///
/// # Errors
/// [`DiscoverError`] if the data do not suffice or the model is invalid.
pub fn confirm(
    known: &Known,
    frames: &Frames,
    draft: &'static Definition,
    seed: u64,
) -> Result<Confirmation, DiscoverError> {
    confirmation(&Prepared::new(known, frames, seed)?, draft)
}

/// Counts that a model predicts for every frame, without noise: frame by frame, element by element.
///
/// # Errors
/// [`DiscoverError`] if the parameters are no valid model.
pub fn predict(
    known: &Known,
    frames: &Frames,
    base: &BaseModel,
    effects: &[Effect],
) -> Result<Vec<f32>, DiscoverError> {
    let bins = Bins::of_frames(frames)?;
    let parameters = Parameters {
        sensitivity: base.response.sensitivity_counts_per_mm.clone(),
        run_gain: base.run_gains.clone(),
        baseline: base.run_baselines_counts.clone(),
        walk: base.run_walks.as_ref().map(RandomWalk::of),
        psf: base.psf,
        terms: effects.iter().map(Term::of).collect(),
    };
    let predicted = Predictor::new(known, frames, &bins).predict(&parameters)?;
    #[expect(clippy::cast_possible_truncation, reason = "counts are stored in single precision")]
    let single = predicted.into_iter().map(|counts| counts as f32).collect();
    Ok(single)
}
