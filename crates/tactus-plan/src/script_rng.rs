//! Random numbers that depend on the run's seed and nothing else, now and in later versions.

use rand::Rng;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// `ChaCha8` (Bernstein 2008, 8 rounds) keyed with the seed: its eight bytes, least significant first, then zeros.
#[derive(Debug)]
pub(crate) struct ScriptRng(ChaCha8Rng);

impl ScriptRng {
    pub(crate) fn seeded(seed: u64) -> Self {
        let mut key = [0; 32];
        for (to, from) in key.iter_mut().zip(seed.to_le_bytes()) {
            *to = from;
        }
        Self(ChaCha8Rng::from_seed(key))
    }

    /// Uniform in `[0, 1)`, in steps of 2^-53.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in `0..end`, with a bias below `end` in 2^64.
    fn below(&mut self, end: usize) -> usize {
        let wide = (u128::from(self.0.next_u64()) * end as u128) >> 64;
        usize::try_from(wide).unwrap_or(0)
    }

    /// Every order equally likely (Fisher and Yates, in Durstenfeld's form, from the end).
    pub(crate) fn shuffle<T>(&mut self, values: &mut [T]) {
        for last in (1..values.len()).rev() {
            values.swap(last, self.below(last + 1));
        }
    }
}

#[cfg(test)]
#[path = "script_rng_tests.rs"]
mod tests;
