//! How near the curves of drafts come to the hidden physics, on a path that the sets do not have.

use std::fs;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use tactus_hidden::DraftTruth;
use tactus_model::Effect;
use tactus_schema::DraftFile;
use tactus_sets::{Label, PhysicsLabel};
use tactus_work::{Now, Stop, Work, Worked, Worker, work, write_whole};

use super::campaign::Planned;
use super::outcome::parsed;
use super::run::Places;
use crate::program::digest;

/// How near the curve of a draft comes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// SHA-256 of the draft's file.
    pub draft: String,
    /// Its relative error ([`Recipe::relative_error`](tactus_sets::Recipe::relative_error)); `None` if the physics does not show on the
    /// other path.
    pub error: Option<f64>,
}

/// Computes the error of the draft of each set with physics outside the library that has a mean, and writes it beside the labels, for the
/// scorer only. Workers that have the same folders share the sets.
///
/// # Errors
/// If a label or a draft cannot be read, or the result not be written.
pub fn curves(
    sets: &[Planned],
    places: &Places,
    worker: &Worker,
    progress: &(dyn Fn(Option<&str>, Now) + Sync),
) -> Result<Worked> {
    work(&Curves { places }, sets, worker, progress)
}

impl Curve {
    /// That of a set's draft; `None` if it is not computed, or of another draft.
    pub(super) fn read(id: &str, places: &Places) -> Result<Option<Self>> {
        let (curve, draft) = (places.curve(id), places.draft(id));
        if !curve.exists() || !draft.exists() {
            return Ok(None);
        }
        let (curve, draft) = (parsed::<Self>(&curve)?, digest(&draft)?);
        Ok(Some(curve).filter(|curve| curve.draft == draft))
    }
}

/// The hidden physics of a set that has a draft, if a draft can be right.
pub(super) fn drafted(set: &Planned, places: &Places) -> Result<Option<PhysicsLabel>> {
    let label = places.label(&set.id);
    if !places.draft(&set.id).exists() || !label.exists() {
        return Ok(None);
    }
    let has_mean = |physics: &PhysicsLabel| DraftTruth::find(&physics.id).is_some();
    Ok(parsed::<Label>(&label)?.physics.into_iter().find(has_mean))
}

/// The errors of all drafts.
struct Curves<'a> {
    places: &'a Places,
}

impl Work for Curves<'_> {
    type Piece = Planned;
    type Made = Curve;
    type Error = anyhow::Error;

    fn name(&self, set: &Planned) -> String {
        set.id.clone()
    }

    fn is_done(&self, set: &Planned) -> Result<bool> {
        Ok(drafted(set, self.places)?.is_none() || Curve::read(&set.id, self.places)?.is_some())
    }

    fn make(&self, set: &Planned, stop: &Stop) -> Result<Option<Curve>> {
        let hidden = drafted(set, self.places)?.with_context(|| format!("{} had a draft", set.id))?;
        let path = self.places.draft(&set.id);
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let file = DraftFile::from_toml(&text).with_context(|| path.display().to_string())?;
        let effect = Effect::neutral(file.define()?).with("strength", 1.0)?;
        let recipe = set.recipe.clone();
        let Some(error) = stop.unless_set(move || recipe.relative_error(&effect, &hidden)) else {
            return Ok(None);
        };
        Ok(Some(Curve { draft: digest(&path)?, error: error.with_context(|| set.id.clone())? }))
    }

    fn keep(&self, set: &Planned, curve: Curve) -> Result<()> {
        let path = self.places.curve(&set.id);
        let text = serde_json::to_vec_pretty(&curve).with_context(|| set.id.clone())?;
        write_whole(&path, &text).with_context(|| path.display().to_string())
    }
}

#[cfg(test)]
#[path = "curves_tests.rs"]
mod tests;
