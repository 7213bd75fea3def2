//! What was computed at a model. It is asked for again: a model of the path is what is left when the last class is taken away, what
//! was located to judge a class is reported in the end, and a model without names is drafted for against different rivals.

use std::sync::{Arc, Mutex, PoisonError};

use super::draft::Begun;
use super::locate::Located;
use super::pass::Pass;
use super::scatter::Scattered;
use crate::data::DiscoverError;
use crate::fit::Parameters;

/// Greatest number of models of which something is kept. A pass takes some 5 MB.
const MODELS_MAX: usize = 8;

/// The same for drafts, which take 10 to 50 MB.
const DRAFTED_MAX: usize = 2;

/// What is kept of the last models that were asked for.
#[derive(Default)]
pub(crate) struct Memory {
    pub(super) passes: Kept<Arc<Pass>>,
    pub(super) drafts: Kept<Arc<Begun>, DRAFTED_MAX>,
    pub(super) located: Kept<Arc<Located>>,
    pub(super) scattered: Kept<Scattered>,
}

/// Results by model, the oldest first; of so many models at most.
pub(super) struct Kept<T, const MOST: usize = MODELS_MAX>(Mutex<Vec<(Parameters, T)>>);

impl<T, const MOST: usize> Default for Kept<T, MOST> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Clone, const MOST: usize> Kept<T, MOST> {
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
        if kept.len() >= MOST {
            kept.remove(0);
        }
        kept.push((model.clone(), result.clone()));
        Ok(result)
    }
}

#[cfg(test)]
#[path = "memory_tests.rs"]
mod tests;
