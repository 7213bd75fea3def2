//! The model file: what is known of an array, and what its base model lacks; TOML, `tactus.model/1`.
//!
//! Simulators, virtual devices and the discovery of effects all read the same file; discovery writes it. Unknown
//! keys are refused, as are effects and parameters that the library has not.

mod file;

use std::collections::BTreeMap;

use tactus_model::{
    Array, ArrayError, Covering, Effect, EffectError, ForwardModel, Indenter, ModelError, Psf, Registration,
    Response, Simulator,
};

use crate::Rig;
use crate::description::WrongField;

pub use file::SCHEMA;

/// A checked model.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The base model.
    pub base: BaseModel,
    /// What the base model lacks, in the order in which effects of one stage act.
    pub effects: Vec<KnownEffect>,
}

/// The base model's parameters, with standard errors where they were estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct BaseModel {
    /// The elements.
    pub array: Array,
    /// Spread against covering thickness.
    pub psf: Psf,
    /// Standard errors of the spread's intercept and slope.
    pub psf_se: [Option<f64>; 2],
    /// How the elements answer.
    pub response: Response,
    /// Standard errors of the sensitivities, one per element.
    pub sensitivity_counts_per_mm_se: Option<Vec<f64>>,
    /// Standard errors of the baselines, one per element.
    pub baseline_counts_se: Option<Vec<f64>>,
    /// Standard errors of the quadratic terms, one per element.
    pub quadratic_per_mm_se: Option<Vec<f64>>,
    /// Standard deviation of an element's noise.
    pub noise_rms_counts: f64,
}

/// An effect, and how it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownEffect {
    /// The effect.
    pub effect: Effect,
    /// Standard errors of its parameters, by name; of those that were estimated.
    pub standard_errors: BTreeMap<String, f64>,
    /// What put it there.
    pub evidence: Option<Evidence>,
}

/// The data that an effect explains, and how well.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Id of the data.
    pub data: String,
    /// Root mean square of the residuals on held-out presses without the effect.
    pub heldout_rms_before_counts: f64,
    /// The same with it.
    pub heldout_rms_after_counts: f64,
}

/// Why a file is not a model.
#[derive(Debug, thiserror::Error)]
pub enum ModelFileError {
    /// Not TOML of the right form; the text names line and key.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// The array's description is contradictory.
    #[error("base.array: {0}")]
    Array(#[from] ArrayError),
    /// The base parameters make no forward model.
    #[error("base: {0}")]
    Base(#[from] ModelError),
    /// An entry is no effect.
    #[error("effect[{index}]: {source}")]
    Effect {
        /// Index of the entry.
        index: usize,
        /// What is wrong with it.
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
    /// What a rig's description says: its response is linear, it has no effects, and its noise is not stated, so 0.
    /// Nothing of what a simulated rig hides is in it.
    ///
    /// `None` if the rig's reference indenter is not among its tools, which no checked rig has.
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
    /// The spread in mm, the response to the reference press, the noise and the effects stay. What was each
    /// element's own becomes the median over the elements for all, and standard errors of such values go, as do
    /// effects that name elements. So the paper's Fig. 10 shows one covering on arrays of other resolutions.
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
    /// [`ModelError`] if a parameter was changed to what no model can have, or an array is given for which
    /// there is no reference press.
    pub fn forward(&self) -> Result<ForwardModel, ModelError> {
        let BaseModel { array, psf, response, .. } = &self.base;
        ForwardModel::new(array.clone(), *psf, response.clone())
    }

    /// A sensor of this model: where it lies, the height of its surface, what covers it, and the tool.
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
    /// Parameters that were not estimated, of a sensor without noise.
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

/// The middle value, or the mean of the two in the middle; 0 of nothing.
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
