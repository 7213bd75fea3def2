//! Writes into each label how far its physics is from the nearest wrong effect.

use std::fs;

use anyhow::{Context, Result};
use rayon::ThreadPoolBuilder;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use tactus_sets::Label;

use super::campaign::Planned;
use super::outcome::parsed;
use super::run::Places;

/// Fits the library's effects to the physics of each set that has a label, and keeps the fits there, for the scorer only. Labels that
/// have them are skipped. `progress` gets the id of each set that was done.
///
/// # Errors
/// If a label cannot be read or written.
pub fn separate(
    sets: &[Planned],
    places: &Places,
    jobs: usize,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<()> {
    let pool = ThreadPoolBuilder::new().num_threads(jobs.max(1)).build()?;
    pool.install(|| sets.par_iter().try_for_each(|set| one(set, places, progress)))
}

fn one(set: &Planned, places: &Places, progress: &(dyn Fn(&str) + Sync)) -> Result<()> {
    let path = places.label(&set.id);
    if !path.exists() {
        return Ok(());
    }
    let mut label: Label = parsed(&path)?;
    let mut is_new = false;
    for dosed in &mut label.physics {
        if dosed.z_of_effects.is_empty() {
            dosed.z_of_effects = set.recipe.class_fits(dosed).with_context(|| set.id.clone())?.effects;
            is_new = true;
        }
    }
    if is_new {
        let text = serde_json::to_string_pretty(&label).with_context(|| set.id.clone())?;
        fs::write(&path, text).with_context(|| path.display().to_string())?;
        progress(&set.id);
    }
    Ok(())
}

#[cfg(test)]
#[path = "separate_tests.rs"]
mod tests;
