//! Memory for the counts of readings, used again and again.

use std::collections::VecDeque;
use std::sync::Arc;

/// Readings whose memory is kept. A recorder holds what came in 100 ms: 3 at 30 Hz, 500 at 5 kHz.
const KEPT_MAX: usize = 1024;

/// Makes the counts of a reading, once nobody holds that of an earlier one any more, in its memory.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    /// The oldest first: it is the first that nobody holds.
    kept: VecDeque<Arc<[f32]>>,
}

impl Memory {
    /// So many counts, written by `write`.
    pub(crate) fn counts(&mut self, elements: usize, write: impl FnOnce(&mut [f32])) -> Arc<[f32]> {
        let is_free = |kept: &mut Arc<[f32]>| kept.len() == elements && Arc::get_mut(kept).is_some();
        let free = self.kept.pop_front_if(is_free);
        let mut counts = free.unwrap_or_else(|| std::iter::repeat_n(0.0, elements).collect());
        if let Some(counts) = Arc::get_mut(&mut counts) {
            write(counts);
        }
        if self.kept.len() < KEPT_MAX {
            self.kept.push_back(Arc::clone(&counts));
        }
        counts
    }
}

#[cfg(test)]
#[path = "memory_tests.rs"]
mod tests;
