//! The temperature of the room.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The room's temperature: a mean, a slow trend and a slow swing.
#[derive(Debug, Clone, Copy)]
pub struct Climate {
    mean_c: f64,
    trend_c: f64,
    swing_c: f64,
    period_s: f64,
    phase_rad: f64,
}

impl Climate {
    /// The climate of a seed: 19 to 25 degrees Celsius, with a trend and a swing.
    pub fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Self {
            mean_c: rng.random_range(19.0..25.0),
            trend_c: rng.random_range(-2.0..2.0),
            swing_c: rng.random_range(0.3..1.2),
            period_s: rng.random_range(80.0..400.0),
            phase_rad: rng.random_range(0.0..std::f64::consts::TAU),
        }
    }

    /// Temperature at a time, degrees Celsius.
    pub fn at(&self, t_s: f64) -> f64 {
        let Self { mean_c, trend_c, swing_c, period_s, phase_rad } = self;
        // After a quarter of an hour the trend is over.
        let trend = trend_c * (1.0 - (-t_s / 300.0).exp());
        mean_c + trend + swing_c * (std::f64::consts::TAU * t_s / period_s + phase_rad).sin()
    }
}
