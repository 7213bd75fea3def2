//! Random numbers that a seed determines, the same on every machine.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

#[derive(Debug, Clone)]
pub(crate) struct Rng(ChaCha8Rng);

impl Rng {
    pub(crate) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// 64 independent bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in `0..end`; 0 if `end` is 0.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        let end = end.max(1) as u64;
        // Draws from the last, incomplete multiple of `end` would favour small numbers.
        let complete = u64::MAX - u64::MAX % end;
        let draw = std::iter::repeat_with(|| self.bits()).find(|bits| *bits < complete);
        #[expect(clippy::cast_possible_truncation, reason = "below a usize")]
        let index = draw.map_or(0, |bits| bits % end) as usize;
        index
    }

    /// Puts items into random order (Fisher and Yates).
    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last + 1));
        }
    }
}

#[cfg(test)]
#[path = "rng_tests.rs"]
mod tests;
