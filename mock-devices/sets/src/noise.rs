//! Noise of the readings.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// The kind of noise of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum NoiseKind {
    /// Independent readings, 0.5-4 counts.
    White,
    /// First-order autoregression with a coefficient of 0.3-0.9, 0.5-4 counts.
    Coloured,
    /// Independent readings, 0.3-1 count, so that quantisation in steps of one count is visible.
    Quantised,
    /// One of the three at random.
    #[default]
    Any,
}

/// Gaussian noise of every element, `x_k = phi x_(k-1) + sqrt(1 - phi^2) rms n_k`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Standard deviation of a reading.
    pub rms_counts: f64,
    /// Correlation of a reading's noise with that of the previous reading, in `[0, 1)`.
    pub phi: f64,
}

impl Noise {
    /// Draws noise of a kind.
    pub fn draw(kind: NoiseKind, rng: &mut ChaCha8Rng) -> Self {
        let kind = match kind {
            NoiseKind::Any => {
                [NoiseKind::White, NoiseKind::Coloured, NoiseKind::Quantised][rng.random_range(0..3)]
            }
            NoiseKind::White | NoiseKind::Coloured | NoiseKind::Quantised => kind,
        };
        let mut log_between = |least: f64, most: f64| rng.random_range(least.ln()..most.ln()).exp();
        match kind {
            NoiseKind::Quantised => Self { rms_counts: log_between(0.3, 1.0), phi: 0.0 },
            NoiseKind::Coloured => {
                Self { rms_counts: log_between(0.5, 4.0), phi: rng.random_range(0.3..0.9) }
            }
            NoiseKind::White | NoiseKind::Any => Self { rms_counts: log_between(0.5, 4.0), phi: 0.0 },
        }
    }

    /// A generator of noise. Each call fills one frame: one value per element.
    pub fn series(&self, rng: &mut ChaCha8Rng, elements: usize) -> impl FnMut(&mut [f64]) {
        let Self { rms_counts, phi } = *self;
        let fresh = (1.0 - phi * phi).sqrt();
        let mut last: Vec<f64> = (0..elements).map(|_| StandardNormal.sample(rng)).collect();
        move |row| {
            for (value, last) in row.iter_mut().zip(&mut last) {
                *value = rms_counts * *last;
                let deviate: f64 = StandardNormal.sample(rng);
                *last = phi * *last + fresh * deviate;
            }
        }
    }

    /// The effective standard deviation of a reading in a mean of many readings, with quantisation in steps of
    /// `step_counts`: `sqrt(rms^2 (1 + phi)/(1 - phi) + step^2/12)`.
    pub fn effective_rms_counts(&self, step_counts: f64) -> f64 {
        let Self { rms_counts, phi } = self;
        (rms_counts * rms_counts * (1.0 + phi) / (1.0 - phi) + step_counts * step_counts / 12.0).sqrt()
    }
}

#[cfg(test)]
#[path = "noise_tests.rs"]
mod tests;
