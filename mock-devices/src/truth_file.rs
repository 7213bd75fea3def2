//! A sensor to hide in the place of a rig's own, from a file.

use tactus_model::{Array, Effect, EffectError, ModelError};
use tactus_schema::Rig;
use tactus_schema::model::{Model, ModelFileError};

use crate::truth::Truth;

/// A model that the virtual devices are to hide: base parameters, noise and effects.
///
/// Stage, tool, registration error, surface and the faults of elements stay the rig's.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthFile(Model);

/// Why a file cannot be the truth of a rig's virtual devices.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// It is no model file.
    #[error(transparent)]
    Model(#[from] ModelFileError),
    /// Its base parameters make no forward model.
    #[error("base: {0}")]
    Base(#[from] ModelError),
    /// It is of another array.
    #[error("base.array: {truth} is not the array of rig {rig:?}, {of_rig}")]
    Array {
        /// The file's array.
        truth: String,
        /// The rig's name.
        rig: String,
        /// The rig's array.
        of_rig: String,
    },
    /// An effect names an element that the array has not.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// An effect would do nothing, or something else, on devices that run.
    #[error(
        "{effect}: {parameter} = {value} cannot act on running devices, which {lack}; remove the effect, or make it {instead}"
    )]
    CannotAct {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// What the devices do not know.
        lack: &'static str,
        /// Values that can act, or that ask for nothing.
        instead: &'static str,
    },
}

impl TruthFile {
    /// Reads a model file.
    ///
    /// # Errors
    /// [`TruthError::Model`] names the line and key, or the field, that is wrong; [`TruthError::CannotAct`] an effect
    /// that no running device can have.
    pub fn from_toml(text: &str) -> Result<Self, TruthError> {
        let model = Model::from_toml(text)?;
        model.effects.iter().try_for_each(|known| can_act(&known.effect))?;
        Ok(Self(model))
    }

    /// What the rig's devices then hide; the seed is that of everything random.
    ///
    /// # Errors
    /// [`TruthError`] if it is of another array than the rig's.
    pub fn behind(&self, rig: &Rig, seed: u64) -> Result<Truth, TruthError> {
        let Model { base, effects } = &self.0;
        if base.array != rig.array {
            let [truth, of_rig] = [&base.array, &rig.array].map(describe);
            return Err(TruthError::Array { truth, rig: rig.name.clone(), of_rig });
        }
        let effects: Vec<Effect> = effects.iter().map(|known| known.effect.clone()).collect();
        effects.iter().try_for_each(|effect| effect.fits(&rig.array))?;
        let noise_rms_counts = base.noise_rms_counts;
        Ok(Truth { model: self.0.forward()?, effects, noise_rms_counts, ..Truth::of_rig(rig, seed) })
    }
}

/// Checks that running devices know what an effect acts on: the tip's past, and no temperature.
fn can_act(effect: &Effect) -> Result<(), TruthError> {
    for (parameter, value) in effect.parameters() {
        let (lack, instead) = match (effect.name(), parameter) {
            ("time-lag", "lag_s") if value < 0.0 => ("do not know where the tip will be", "0 or more"),
            _ if parameter.ends_with("_per_k") && value != 0.0 => ("know no temperature", "0"),
            _ => continue,
        };
        return Err(TruthError::CannotAct { effect: effect.name(), parameter, value, lack, instead });
    }
    Ok(())
}

/// An array by its name and by what else two of one name can differ in.
fn describe(array: &Array) -> String {
    let [[left, right], [bottom, top]] = array.extent_mm();
    format!(
        "{:?} ({} x {} elements on {:.1} x {:.1} mm, {} Hz, {} counts in steps of {})",
        array.name(),
        array.rows(),
        array.cols(),
        right - left,
        top - bottom,
        array.rate_hz(),
        array.full_scale_counts(),
        array.step_counts()
    )
}

#[cfg(test)]
#[path = "truth_file_tests.rs"]
mod tests;
