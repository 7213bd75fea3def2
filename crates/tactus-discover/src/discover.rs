//! The protocol: recalibrate, test, locate, name, add, and again.

use std::collections::BTreeMap;

use tactus_model::{Array, Effect, EffectError, Indenter, ModelError, Psf, Registration, Response};

use crate::{Base, Discovery, Frames};

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
    _known: &Known,
    _frames: &Frames,
    _options: Options,
    _progress: &(dyn Fn(Progress) + Sync),
) -> Result<Discovery, DiscoverError> {
    todo!()
}

/// What a model gives for every frame, before noise: frame by frame, element by element, in counts.
///
/// # Errors
/// [`DiscoverError`] if the parameters make no model.
pub fn predict(
    _known: &Known,
    _frames: &Frames,
    _base: &Base,
    _effects: &[Effect],
) -> Result<Vec<f32>, DiscoverError> {
    todo!()
}
