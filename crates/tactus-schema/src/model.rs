//! The model file: an array's base model and the effects that add to it; TOML, `tactus.model/1`.
//!
//! Simulators, virtual devices and the discovery of effects read it; discovery writes it. Unknown keys, effects and
//! parameters are refused.
//!
//! An effect has its formula, with a value for each parameter, or a free curve in place of the formula: `knots`, with places and values under
//! the keys that the effect's page gives ([`tactus_model::effect::FreeCurve`]), and the parameters that the knots do not replace.
//!
//! ```toml
//! [[effect]]
//! name = "hardening"
//! parameters = { own_share = 0.0 }
//! knots = { at_mm = [0.2, 0.4, 0.6], growth = [0.0, 0.3, 0.4] }
//! ```
//!
//! A parameter that may differ with where the tip stands, or with time ([`tactus_model::effect::Parameter::varies`]) has a value or a table:
//!
//! ```toml
//! [[effect]]
//! name = "indenter-size"
//! tables.ratio = { by = "depth_mm", at = [0.0, 0.2], values = [0.8, 1.0] }
//! ```
//!
//! An effect that the library does not name is there whole, as `effect.draft` ([`crate::draft`]), so that a model needs no other file.

mod file;

use std::collections::BTreeMap;

use tactus_model::{
    Array, ArrayError, Covering, Effect, EffectError, ForwardModel, Indenter, ModelError, Psf, Registration,
    Response, Simulator,
};

use crate::Rig;
use crate::description::WrongField;

pub use file::SCHEMA;

/// A checked model file.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The model without effects.
    pub base: BaseModel,
    /// What the base model lacks; effects of one stage act in this order.
    pub effects: Vec<KnownEffect>,
}

/// The base model's parameters, with standard errors where they were estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseModel {
    /// Geometry of the array, sensor frame.
    pub array: Array,
    /// Spread against covering thickness.
    pub psf: Psf,
    /// Standard errors of the spread's intercept and slope.
    pub psf_se: [Option<f64>; 2],
    /// Sensitivities, baselines and quadratic terms, one per element.
    pub response: Response,
    /// Standard errors of the sensitivities, one per element.
    pub sensitivity_counts_per_mm_se: Option<Vec<f64>>,
    /// Standard errors of the baselines, one per element.
    pub baseline_counts_se: Option<Vec<f64>>,
    /// Standard errors of the quadratic terms, one per element.
    pub quadratic_per_mm_se: Option<Vec<f64>>,
    /// Standard deviation of an element's noise, in counts.
    pub noise_rms_counts: f64,
}

/// An effect with its standard errors and evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownEffect {
    /// The effect and its parameters.
    pub effect: Effect,
    /// Standard errors of its estimated parameters, by name.
    pub standard_errors: BTreeMap<String, f64>,
    /// The data that showed it; `None` if it was only stated.
    pub evidence: Option<Evidence>,
    /// Version of the draft that it is: the SHA-256 of [`DraftFile::versioned`](crate::DraftFile::versioned), in hexadecimal. `None` of an
    /// effect of the library, or if it is not stated.
    pub version: Option<String>,
}

/// The data that show an effect, and how much it improves the predictions.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Id of the data.
    pub data: String,
    /// Root mean square of the residuals on held-out presses without the effect.
    pub heldout_rms_before_counts: f64,
    /// The same with the effect.
    pub heldout_rms_after_counts: f64,
}

/// Why a file is not a model.
#[derive(Debug, thiserror::Error)]
pub enum ModelFileError {
    /// The TOML is malformed; the text names line and key.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// The array's description is contradictory.
    #[error("base.array: {0}")]
    Array(#[from] ArrayError),
    /// There is no forward model with the base parameters.
    #[error("base: {0}")]
    Base(#[from] ModelError),
    /// An entry is no known effect, or its parameters are wrong.
    #[error("effect[{index}]: {source}")]
    Effect {
        /// Index of the entry, from 0.
        index: usize,
        /// What is wrong with its parameters.
        source: EffectError,
    },
    /// One field is wrong.
    #[error("{field}: {problem}")]
    Field {
        /// Path of the field, such as `base.noise_rms_counts`.
        field: String,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
}

impl From<WrongField> for ModelFileError {
    fn from(WrongField { field, problem }: WrongField) -> Self {
        Self::Field { field, problem }
    }
}

impl Model {
    /// The model that a rig's description states: a linear response, no effects, and noise 0 because it is not stated. It
    /// ignores the hidden truth of a simulated rig.
    ///
    /// `None` if the rig's reference indenter is not among its tools, which a checked rig rules out.
    pub fn of_rig(rig: &Rig) -> Option<Self> {
        let reference = &rig.sensitivity_reference;
        let response = Response {
            sensitivity_counts_per_mm: rig.sensitivity_counts_per_mm.clone(),
            baseline_counts: rig.baseline_counts.clone(),
            quadratic_per_mm: vec![0.0; rig.array.elements()],
            reference_indenter: rig.indenters.get(&reference.indenter)?.clone(),
            reference_covering: reference.covering,
        };
        Some(Self { base: BaseModel::of(rig.array.clone(), rig.psf, response), effects: Vec::new() })
    }

    /// The characterisation carried to another array.
    ///
    /// The spread in mm, the response to the reference press, the noise and the effects stay. Values of single elements are
    /// replaced by their median; their standard errors are dropped, and so are effects that name elements. The paper's
    /// Fig. 10 shows one covering on arrays of other resolutions in this way.
    #[must_use]
    pub fn on(&self, array: Array) -> Self {
        let for_all = |values: &[f64]| vec![median(values); array.elements()];
        let Response { sensitivity_counts_per_mm, baseline_counts, quadratic_per_mm, .. } =
            &self.base.response;
        let response = Response {
            sensitivity_counts_per_mm: for_all(sensitivity_counts_per_mm),
            baseline_counts: for_all(baseline_counts),
            quadratic_per_mm: for_all(quadratic_per_mm),
            ..self.base.response.clone()
        };
        let effects = self.effects.iter().filter(|known| !known.effect.names_elements()).cloned().collect();
        Self {
            base: BaseModel {
                psf_se: self.base.psf_se,
                noise_rms_counts: self.base.noise_rms_counts,
                ..BaseModel::of(array, self.base.psf, response)
            },
            effects,
        }
    }

    /// The base model, ready to use.
    ///
    /// # Errors
    /// [`ModelError`] if a parameter is invalid, or the array has no reference press.
    pub fn forward(&self) -> Result<ForwardModel, ModelError> {
        let BaseModel { array, psf, response, .. } = &self.base;
        ForwardModel::new(array.clone(), *psf, response.clone())
    }

    /// A sensor of this model at a pose, with the height of its surface, a covering and a tool.
    ///
    /// # Errors
    /// As [`Model::forward`].
    pub fn simulator(
        &self,
        registration: Registration,
        surface_mm: f64,
        covering: Covering,
        indenter: Indenter,
    ) -> Result<Simulator, ModelError> {
        Ok(Simulator {
            model: self.forward()?,
            registration,
            surface_mm,
            covering,
            indenter,
            effects: self.effects.iter().map(|known| known.effect.clone()).collect(),
            noise_rms_counts: self.base.noise_rms_counts,
        })
    }
}

impl BaseModel {
    /// Parameters without standard errors, of a sensor without noise.
    pub fn of(array: Array, psf: Psf, response: Response) -> Self {
        Self {
            array,
            psf,
            psf_se: [None; 2],
            response,
            sensitivity_counts_per_mm_se: None,
            baseline_counts_se: None,
            quadratic_per_mm_se: None,
            noise_rms_counts: 0.0,
        }
    }
}

/// The middle value, or the mean of the two in the middle; 0 without values.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match (sorted.len() % 2, sorted.get(middle.wrapping_sub(1)), sorted.get(middle)) {
        (0, Some(low), Some(high)) => f64::midpoint(*low, *high),
        (_, _, Some(value)) => *value,
        _ => 0.0,
    }
}

#[cfg(test)]
#[path = "model_tests.rs"]
mod tests;
