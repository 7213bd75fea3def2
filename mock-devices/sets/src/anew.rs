//! The sensor of a set, measured anew.

use std::sync::Arc;

use tactus_hidden::Dose;
use tactus_model::{Effect, Images};

use crate::label::PhysicsLabel;
use crate::nearest::IMAGES_MAX;
use crate::oracle::{Visit, WIDER};
use crate::recipe::{Recipe, RecipeError};
use crate::set::DataSet;

impl Recipe {
    /// New data of this set's sensor: on another path, an hour later, with other noise of the same kind. The physics is that of labels, such
    /// as the set's own.
    ///
    /// # Errors
    /// As [`Recipe::make`].
    pub fn make_anew(&self, physics: &[PhysicsLabel]) -> Result<DataSet, RecipeError> {
        let doses = physics.iter().map(PhysicsLabel::dose).collect::<Result<Vec<Dose>, _>>()?;
        let base = self.base()?;
        let oracle = self.oracle(&base, Visit::Later)?;
        Ok(self.measured(&oracle, &doses, physics.to_vec()))
    }

    /// The relative error with which an effect describes one physics of this set's label, on a path that the set does not have:
    /// `rms(what the effect leaves) / rms(what the base model leaves)`, both without noise and after gains, offsets and spread are fitted, as in
    /// [`Separation::z_beyond_spread`](crate::Separation::z_beyond_spread). `None` if the base model leaves nothing there.
    ///
    /// # Errors
    /// As [`Recipe::make`], or if the base model does not take the effect.
    pub fn relative_error(&self, effect: &Effect, of: &PhysicsLabel) -> Result<Option<f64>, RecipeError> {
        let base = self.base()?;
        let oracle = self.oracle(&base, Visit::Elsewhere)?;
        let with = oracle.counts(&base, &[of.dose()?]);
        let images = Arc::new(Images::new(IMAGES_MAX));
        let counts_at = |spread: f64| -> Result<Vec<f64>, RecipeError> {
            Ok(oracle.modelled(&base.spread_by(spread)?, effect, &images)?)
        };
        let (true_spread, wider) = (counts_at(1.0)?, counts_at(WIDER)?);
        let left = oracle.separation_from([&true_spread, &wider], |spread| counts_at(spread).ok(), &with);
        let whole = oracle.separation_of(&with).z_beyond_spread;
        Ok((whole > 0.0).then(|| left.z_beyond_spread / whole))
    }
}

#[cfg(test)]
#[path = "anew_tests.rs"]
mod tests;
