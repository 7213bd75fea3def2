//! What was computed at a model. It is asked for again: a model of the path is what is left when the last class is taken away, and what
//! was located to judge a class is reported in the end.

use std::sync::{Arc, Mutex, PoisonError};

use super::locate::Located;
use super::pass::Pass;
use super::scatter::Scattered;
use crate::data::DiscoverError;
use crate::fit::Parameters;

/// Greatest number of models of which something is kept. A pass takes some 5 MB.
const MODELS_MAX: usize = 8;

/// What is kept of the last models that were asked for.
#[derive(Default)]
pub(crate) struct Memory {
    pub(super) passes: Kept<Arc<Pass>>,
    pub(super) located: Kept<Arc<Located>>,
    pub(super) scattered: Kept<Scattered>,
}

/// Results by model, the oldest first.
pub(super) struct Kept<T>(Mutex<Vec<(Parameters, T)>>);

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Clone> Kept<T> {
    /// The result for a model, computed unless it is kept.
    pub(super) fn at(
        &self,
        model: &Parameters,
        compute: impl FnOnce() -> Result<T, DiscoverError>,
    ) -> Result<T, DiscoverError> {
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = kept().iter().find(|(known, _)| known == model).map(|(_, result)| result.clone());
        if let Some(known) = known {
            return Ok(known);
        }
        let result = compute()?;
        let mut kept = kept();
        if kept.len() >= MODELS_MAX {
            kept.remove(0);
        }
        kept.push((model.clone(), result.clone()));
        Ok(result)
    }
}

#[cfg(test)]
#[path = "memory_tests.rs"]
mod tests;
