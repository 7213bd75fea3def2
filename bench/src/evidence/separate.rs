//! Writes into each label how far its physics is from the nearest wrong effect.

use anyhow::{Context, Result};
use tactus_sets::{Label, PhysicsLabel};
use tactus_work::{Now, Stop, Work, Worked, Worker, work, write_whole};

use super::campaign::Planned;
use super::outcome::parsed;
use super::run::Places;
use super::score::Z_NAMEABLE;

/// Fits the library's effects to the physics of each set that has a label, until a wrong one is nearer than [`Z_NAMEABLE`], and keeps the
/// fits there, for the scorer only. Points of the library's own parameters are in no score, and outside the library every name is wrong:
/// neither gets fits. Labels that have fits are kept as they are. Workers that have the same folders share the sets.
///
/// # Errors
/// If a label cannot be read or written.
pub fn separate(
    sets: &[Planned],
    places: &Places,
    worker: &Worker,
    progress: &(dyn Fn(Option<&str>, Now) + Sync),
) -> Result<Worked> {
    work(&Separations { places }, sets, worker, progress)
}

/// The fits to all sets.
struct Separations<'a> {
    places: &'a Places,
}

impl Separations<'_> {
    /// The label of a set, if it has one.
    fn label(&self, set: &Planned) -> Result<Option<Label>> {
        let path = self.places.label(&set.id);
        path.exists().then(|| parsed(&path)).transpose()
    }
}

impl Work for Separations<'_> {
    type Piece = Planned;
    type Made = Label;
    type Error = anyhow::Error;

    fn name(&self, set: &Planned) -> String {
        set.id.clone()
    }

    fn is_done(&self, set: &Planned) -> Result<bool> {
        let label = self.label(set)?;
        Ok(label.is_none_or(|label| label.physics.iter().all(|dosed| unfitted(dosed).is_none())))
    }

    fn make(&self, set: &Planned, stop: &Stop) -> Result<Option<Label>> {
        let mut label = self.label(set)?.with_context(|| format!("{} had a label", set.id))?;
        for dosed in &mut label.physics {
            let Some(right) = unfitted(dosed).map(str::to_owned) else { continue };
            let (recipe, physics) = (set.recipe.clone(), dosed.clone());
            let fits = stop.unless_set(move || recipe.class_fits(&physics, &right, Z_NAMEABLE));
            let Some(fits) = fits else { return Ok(None) };
            dosed.z_of_effects = fits.with_context(|| set.id.clone())?.effects;
        }
        Ok(Some(label))
    }

    fn keep(&self, set: &Planned, label: Label) -> Result<()> {
        let path = self.places.label(&set.id);
        let text = serde_json::to_vec_pretty(&label).with_context(|| set.id.clone())?;
        write_whole(&path, &text).with_context(|| path.display().to_string())
    }
}

/// The effect of a physics that lacks its fits.
fn unfitted(dosed: &PhysicsLabel) -> Option<&str> {
    dosed.effect.as_deref().filter(|_| !dosed.is_library_point && dosed.z_of_effects.is_empty())
}

#[cfg(test)]
#[path = "separate_tests.rs"]
mod tests;
