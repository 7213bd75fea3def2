//! What is in a set: kept apart from it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::noise::Noise;
use crate::plan::Plan;

/// The truth of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// Name of the set, and of its runs.
    pub set: String,
    /// Seed of everything random in it.
    pub seed: u64,
    /// What the stage did.
    pub plan: Plan,
    /// Frames of all runs.
    pub frames: usize,
    /// The physics that is in it.
    pub physics: Vec<PhysicsLabel>,
    /// Separation of all of it together from the recalibrated base model (see [`Separation`](crate::Separation)); 0
    /// without physics.
    pub z: f64,
    /// The same after the spread was recalibrated too.
    pub z_beyond_spread: f64,
    /// The noise.
    pub noise: Noise,
    /// True sensitivities, counts per mm.
    pub sensitivity_counts_per_mm: Vec<f64>,
    /// True baselines.
    pub baseline_counts: Vec<f64>,
    /// True spread without covering.
    pub sigma_intercept_mm: f64,
    /// True spread gained with each mm of covering.
    pub sigma_per_mm: f64,
}

/// One physics of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhysicsLabel {
    /// Its id in the catalogue.
    pub id: String,
    /// The effect that it is an instance of; none outside the library.
    pub effect: Option<String>,
    /// How much of it.
    pub strength: f64,
    /// Its separation alone.
    pub z: f64,
    /// The same after the spread was recalibrated too.
    pub z_beyond_spread: f64,
    /// False if no strength gives the separation that was asked for; then the nearest is in it.
    pub reached: bool,
    /// Seed of its shape.
    pub seed: u64,
    /// What was drawn, by name.
    pub parameters: BTreeMap<String, f64>,
}

impl Label {
    /// Names of the library's effects that are in the set.
    pub fn effects(&self) -> Vec<&str> {
        self.physics.iter().filter_map(|dosed| dosed.effect.as_deref()).collect()
    }
}
