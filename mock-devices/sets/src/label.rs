//! The truth about a data set, stored in another folder.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tactus_hidden::{Definition, Dose};

use crate::nearest::ClassFits;
use crate::noise::Noise;
use crate::plan::Plan;
use crate::recipe::RecipeError;

/// The truth of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// Name of the set, and of its runs.
    pub set: String,
    /// Seed of everything random in it.
    pub seed: u64,
    /// What the stage does.
    pub plan: Plan,
    /// Frames of all runs.
    pub frames: usize,
    /// Its hidden physics.
    pub physics: Vec<PhysicsLabel>,
    /// [`Separation::z`](crate::Separation::z) of all physics together; 0 without physics.
    pub z: f64,
    /// [`Separation::z_beyond_spread`](crate::Separation::z_beyond_spread) of all physics together.
    pub z_beyond_spread: f64,
    /// Noise of the readings.
    pub noise: Noise,
    /// True sensitivities, counts per mm.
    pub sensitivity_counts_per_mm: Vec<f64>,
    /// True baselines, counts.
    pub baseline_counts: Vec<f64>,
    /// True spread without a covering.
    pub sigma_intercept_mm: f64,
    /// True increase of the spread with each mm of covering.
    pub sigma_per_mm: f64,
}

/// One physics of a data set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhysicsLabel {
    /// Its id in the catalogue.
    pub id: String,
    /// The library's effect that it is an instance of; `None` outside the library.
    pub effect: Option<String>,
    /// True if it is a point of that effect's own parameters.
    pub is_library_point: bool,
    /// Strength of its dose.
    pub strength: f64,
    /// [`Separation::z`](crate::Separation::z) of this physics alone.
    pub z: f64,
    /// [`Separation::z_beyond_spread`](crate::Separation::z_beyond_spread) of this physics alone.
    pub z_beyond_spread: f64,
    /// How far each effect of the library, fitted to this physics alone, stays from it
    /// ([`ClassFits::effects`](crate::ClassFits::effects)); empty until it is computed.
    #[serde(default)]
    pub z_of_effects: BTreeMap<String, f64>,
    /// False if no strength gives the requested separation; the strength is then that of the nearest.
    pub reached: bool,
    /// Seed of its shape.
    pub seed: u64,
    /// Its parameters, by name.
    pub parameters: BTreeMap<String, f64>,
}

impl PhysicsLabel {
    /// The physics at its strength.
    pub(crate) fn dose(&self) -> Result<Dose, RecipeError> {
        let physics =
            Definition::find(&self.id).ok_or_else(|| RecipeError::UnknownPhysics(self.id.clone()))?;
        Ok(Dose { physics, strength: self.strength, seed: self.seed })
    }

    /// The fits of the library's effects to it, if they are computed.
    pub fn class_fits(&self) -> Option<ClassFits> {
        let effects = self.z_of_effects.clone();
        (!effects.is_empty()).then_some(ClassFits { base: self.z_beyond_spread, effects })
    }
}

impl Label {
    /// Takes over the fits of another label if it is of the same set: they follow from all else in it.
    pub fn adopt_fits(&mut self, earlier: &Self) {
        let mut bare = earlier.clone();
        bare.physics.iter_mut().for_each(|dosed| dosed.z_of_effects.clear());
        if bare == *self {
            self.clone_from(earlier);
        }
    }

    /// Names of the library's effects in the set.
    pub fn effects(&self) -> Vec<&str> {
        self.physics.iter().filter_map(|dosed| dosed.effect.as_deref()).collect()
    }
}

#[cfg(test)]
#[path = "label_tests.rs"]
mod tests;
