//! The protocol: recalibrate, test, locate, name, add, and again.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use rayon::ThreadPoolBuilder;
use tactus_model::{Array, Effect, EffectError, Indenter, ModelError, Psf, Registration, Response};

use crate::candidates::Candidate;
use crate::prepare::Prepared;
use crate::rows::Rows;
use crate::search::{Grown, Search, Stage};
use crate::sensor::{Parameters, Sensor, Term};
use crate::telling::{Found, tell};
use crate::wander::Wander;
use crate::{Base, Discovery, Frames, not_shown};

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
    /// How many threads compute; 0 counts as 1. The result does not depend on it.
    pub threads: usize,
    /// By which rule effects are added.
    pub rule: Rule,
}

/// By which rule effects are added.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Rule {
    /// The protocol: corrected tests, held-out presses, other effects in each one's place.
    #[default]
    Protocol,
    /// The Bayesian information criterion of the fitted presses alone, forward: what the protocol is compared to.
    Bic,
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
    /// The operating system starts no more threads.
    #[error("cannot start {threads} threads: {reason}")]
    Threads {
        /// [`Options::threads`].
        threads: usize,
        /// From the operating system.
        reason: String,
    },
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
    let threads = options.threads.max(1);
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| DiscoverError::Threads { threads, reason: error.to_string() })?;
    pool.install(|| discover_on_threads(known, frames, options, progress))
}

fn discover_on_threads(
    known: &Known,
    frames: &Frames,
    options: Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Discovery, DiscoverError> {
    let said = Said { progress, share: Mutex::new(0.0) };
    said.say("recalibrating the base model", 0.02);
    let prepared = Prepared::new(known, frames, options)?;
    let problem = prepared.problem();
    let base = prepared.base.clone();
    said.say("scoring the effects", 0.1);
    let lacking = not_shown::lacking(&problem, prepared.replicates);
    let mut candidates = Candidate::all(&problem, &base, &prepared.frequencies_hz)?;
    candidates.retain(|one| lacking.iter().all(|lacking| lacking.effect != one.definition.name));
    let search = Search {
        problem: &problem,
        candidates: &candidates,
        options,
        known_terms: known.effects.len(),
        base_gap: problem.heldout_gap(&base.predicted).value,
        progress: &|what| said.say(what, 0.0),
    };
    let before = search.locate(&base)?;
    let stage = |stage: Stage| match stage {
        Stage::TakingBack => said.say("taking back what does not earn its place", 0.6),
        Stage::Exchanging => said.say("trying every other effect in each one's place", 0.7),
    };
    let Grown { at: grown, rounds, equivalent, .. } = match options.rule {
        Rule::Protocol => search.grow(&base, &stage)?,
        Rule::Bic => search.grow_by_bic(base.clone())?,
    };
    said.say("what is left", 0.9);
    let after = search.locate(&grown)?;
    said.say("planning what to measure next", 0.95);
    let told =
        tell(&prepared, &search, Found { lacking, base, grown, rounds, equivalent, before, after }, options)?;
    said.say("done", 1.0);
    Ok(told)
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
        wander: base.run_wander.as_ref().map(Wander::of),
        psf: base.psf,
        terms: effects.iter().map(Term::of).collect(),
    };
    let predicted = Sensor::new(known, frames, &rows).predict(&parameters)?;
    #[expect(clippy::cast_possible_truncation, reason = "counts are stored in single precision")]
    let single = predicted.into_iter().map(|counts| counts as f32).collect();
    Ok(single)
}

/// Says how far it has come; the share never falls.
struct Said<'a> {
    progress: &'a (dyn Fn(Progress) + Sync),
    share: Mutex<f64>,
}

impl Said<'_> {
    fn say(&self, what: &str, share: f64) {
        let mut held = self.share.lock().unwrap_or_else(PoisonError::into_inner);
        // What has no share of its own goes part of the way.
        *held = if share > 0.0 { held.max(share) } else { *held + 0.01 * (1.0 - *held) };
        (self.progress)(Progress { what: what.to_owned(), share: *held });
    }
}
