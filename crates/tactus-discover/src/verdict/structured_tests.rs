use std::f64::consts::{SQRT_2, TAU};
use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::*;

const PRESSES: usize = 60;
const FRAMES: usize = 8;
const ELEMENTS: usize = 12;

/// White noise of standard deviation 1, and a sinusoid over the place of each press.
struct Planted {
    residual: Vec<f32>,
    presses: Vec<Range<usize>>,
}

impl Planted {
    fn new(rms: f64, rng: &mut ChaCha8Rng) -> Self {
        let mut residual = Vec::new();
        for _ in 0..PRESSES {
            let x_mm = rng.random_range(0.0..16.0);
            let structure = rms * SQRT_2 * (TAU * x_mm / 3.0).sin();
            for _ in 0..FRAMES * ELEMENTS {
                let noise: f64 = StandardNormal.sample(rng);
                #[expect(clippy::cast_possible_truncation, reason = "residuals are stored so")]
                residual.push((structure + noise) as f32);
            }
        }
        let presses = (0..PRESSES).map(|press| press * FRAMES..(press + 1) * FRAMES).collect();
        Self { residual, presses }
    }

    /// What is structured if the noise is believed to be `noise`.
    fn seen(&self, noise: f64, freedom: f64) -> Structured {
        let readings = Readings {
            elements: ELEMENTS,
            residual: &self.residual,
            signal: &vec![0.0; self.residual.len()],
            presses: &self.presses,
            noise_counts: &[noise; ELEMENTS],
            unit_counts: &[noise; ELEMENTS],
            lag: 1,
            correlation: 0.0,
            rounding_share: 0.0,
            freedom,
        };
        readings.structured(|_| true).unwrap()
    }
}

#[test]
fn the_bound_covers_a_planted_sinusoid() {
    for rms in [0.2, 0.5, 1.0] {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        let draws = (0..200).map(|_| Planted::new(rms, &mut rng).seen(1.0, 1e9));
        let covered = draws.filter(|seen| seen.upper_noise >= rms).count();
        assert!(covered >= 186, "{rms}: {covered} of 200");
    }
}

#[test]
fn the_bound_covers_a_planted_sinusoid_under_noise_that_is_known_from_few_repeats() {
    let estimate = ChiSquared::new(20.0).unwrap();
    for rms in [0.2, 0.5, 1.0] {
        let mut rng = ChaCha8Rng::seed_from_u64(22);
        let covered = (0..200).filter(|_| {
            let noise = (estimate.sample(&mut rng) / 20.0_f64).sqrt();
            let seen = Planted::new(rms, &mut rng).seen(noise, 20.0);
            seen.upper_noise >= rms / noise
        });
        let covered = covered.count();
        assert!(covered >= 186, "{rms}: {covered} of 200");
    }
}

#[test]
fn the_bound_of_noise_alone_is_small_and_that_of_structure_is_near_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(23);
    let nothing = Planted::new(0.0, &mut rng).seen(1.0, 1e9);
    assert!(nothing.upper_noise < 0.35, "{nothing:?}");
    let much = Planted::new(3.0, &mut rng).seen(1.0, 1e9);
    assert!((much.rms_noise / 3.0 - 1.0).abs() < 0.25 && much.upper_noise < 4.0, "{much:?}");
}

/// Of a noise that is taken to be twice as large as it is, nothing would be left above it.
#[test]
fn what_lasts_is_seen_also_under_a_noise_that_is_taken_to_be_too_large() {
    let mut rng = ChaCha8Rng::seed_from_u64(24);
    let seen = Planted::new(1.0, &mut rng).seen(2.0, 1e9);
    assert!(seen.upper_noise * 2.0 > 0.95, "{seen:?}");
}

#[test]
fn few_presses_give_no_bound() {
    let mut rng = ChaCha8Rng::seed_from_u64(25);
    let mut planted = Planted::new(0.0, &mut rng);
    planted.presses.truncate(2);
    assert!(planted.seen(1.0, 1e9).upper_noise.is_infinite());
}
