//! A file with another truth for the virtual devices than the rig file's.

use serde::Deserialize;
use tactus_hidden::{Definition, Dose, STRENGTH_MAX};
use tactus_model::{Array, Effect, EffectError, ModelError};
use tactus_schema::Rig;
use tactus_schema::model::{Model, ModelFileError};

use crate::truth::Truth;

/// What the virtual devices hide instead of the rig's own sensor: a model (base parameters, noise and effects), or hidden
/// physics on top of the rig's simulation.
///
/// Stage, tool, registration error, surface and faults of elements remain those of the rig.
#[derive(Debug, Clone)]
pub struct TruthFile(Content);

/// Schema of a file of hidden physics.
pub const HIDDEN_SCHEMA: &str = "tactus.hidden/1";

#[derive(Debug, Clone)]
enum Content {
    Model(Box<Model>),
    Physics(Vec<Dose>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HiddenFile {
    #[serde(rename = "schema")]
    _schema: String,
    physics: Vec<DoseEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DoseEntry {
    id: String,
    #[serde(default = "one")]
    strength: f64,
    #[serde(default)]
    seed: u64,
}

/// Why a file cannot be the truth of a rig's virtual devices.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum TruthError {
    /// It is no model file.
    #[error(transparent)]
    Model(#[from] ModelFileError),
    /// It is no file of hidden physics; the text names line and key.
    #[error("{0}")]
    Hidden(#[from] toml::de::Error),
    /// An entry is no hidden physics; the problem says what would be right.
    #[error("physics[{index}].{field}: {problem}")]
    Physics { index: usize, field: &'static str, problem: String },
    /// Its base parameters make no forward model.
    #[error("base: {0}")]
    Base(#[from] ModelError),
    /// It describes another array.
    #[error("base.array: {truth} is not the array of rig {rig:?}, {of_rig}")]
    Array { truth: String, rig: String, of_rig: String },
    /// An effect names an element that the array does not have.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// Running devices cannot show the effect: they do not know the tip's future, or the temperature.
    #[error(
        "{effect}: {parameter} = {value} cannot act on running devices, which {lack}; remove the effect, or make it {instead}"
    )]
    CannotAct {
        effect: &'static str,
        parameter: &'static str,
        value: f64,
        lack: &'static str,
        instead: &'static str,
    },
}

impl TruthFile {
    /// Reads a model file, or a file of hidden physics if its `schema` is [`HIDDEN_SCHEMA`].
    ///
    /// # Errors
    /// [`TruthError::Model`], [`TruthError::Hidden`] and [`TruthError::Physics`] name the line and key, or the field.
    /// [`TruthError::CannotAct`] names an effect that no running device can have.
    pub fn from_toml(text: &str) -> Result<Self, TruthError> {
        let is_hidden =
            |table: toml::Table| table.get("schema").and_then(toml::Value::as_str) == Some(HIDDEN_SCHEMA);
        if text.parse().is_ok_and(is_hidden) {
            let file: HiddenFile = toml::from_str(text)?;
            let doses = file.physics.iter().enumerate().map(|(index, entry)| entry.dose(index));
            return Ok(Self(Content::Physics(doses.collect::<Result<_, _>>()?)));
        }
        let model = Model::from_toml(text)?;
        model.effects.iter().try_for_each(|known| can_act(&known.effect))?;
        Ok(Self(Content::Model(Box::new(model))))
    }

    /// The truth of the rig's devices with this file; `seed` is that of everything random.
    ///
    /// # Errors
    /// [`TruthError`] if it describes another array than the rig's, or does not fit it.
    pub fn behind(&self, rig: &Rig, seed: u64) -> Result<Truth, TruthError> {
        let model = match &self.0 {
            Content::Model(model) => model,
            Content::Physics(physics) => {
                return Ok(Truth { physics: physics.clone(), ..Truth::of_rig(rig, seed) });
            }
        };
        let Model { base, effects } = &**model;
        if base.array != rig.array {
            let [truth, of_rig] = [&base.array, &rig.array].map(describe);
            return Err(TruthError::Array { truth, rig: rig.name.clone(), of_rig });
        }
        let effects: Vec<Effect> = effects.iter().map(|known| known.effect.clone()).collect();
        effects.iter().try_for_each(|effect| effect.fits(&rig.array))?;
        let noise_rms_counts = base.noise_rms_counts;
        Ok(Truth { model: model.forward()?, effects, noise_rms_counts, ..Truth::of_rig(rig, seed) })
    }
}

impl DoseEntry {
    fn dose(&self, index: usize) -> Result<Dose, TruthError> {
        let wrong = |field, problem| TruthError::Physics { index, field, problem };
        let Self { id, strength, seed } = self;
        let physics = Definition::find(id).ok_or_else(|| {
            wrong("id", format!("no physics {id:?}; `tactus-mock hidden list` names all of them"))
        })?;
        if !(*strength >= 0.0 && *strength <= STRENGTH_MAX) {
            return Err(wrong("strength", format!("must be from 0 to {STRENGTH_MAX}, not {strength}")));
        }
        Ok(Dose { physics, strength: *strength, seed: *seed })
    }
}

fn one() -> f64 {
    1.0
}

/// Checks that running devices can show an effect. They know the tip's past, but neither its future nor a temperature.
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

/// Describes an array by its name and every property in which two of one name can differ.
fn describe(array: &Array) -> String {
    let [[left, right], [bottom, top]] = array.extent_mm();
    format!(
        "{:?} ({} x {} elements on {:.1} x {:.1} mm, {} Hz, {} to {} counts in steps of {})",
        array.name(),
        array.rows(),
        array.cols(),
        right - left,
        top - bottom,
        array.rate_hz(),
        array.least_counts(),
        array.full_scale_counts(),
        array.step_counts()
    )
}

#[cfg(test)]
#[path = "truth_file_tests.rs"]
mod tests;
