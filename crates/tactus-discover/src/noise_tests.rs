use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_schema::table::{Phase, RowView};

use super::Noise;
use crate::Frames;
use crate::bins::still;

/// A tip at rest under first-order autoregressive noise of standard deviation 3, beside a slow ramp.
fn resting(phi: f64) -> Frames {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut frames = Frames::new(4);
    let mut noise = [0.0; 4];
    for (index, t_ns) in (0..6000).zip((0..).step_by(33_333_333)) {
        for noise in &mut noise {
            let fresh: f64 = StandardNormal.sample(&mut rng);
            *noise = phi * *noise + 3.0 * (1.0 - phi * phi).sqrt() * fresh;
        }
        let ramp = 0.002 * f64::from(index);
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts = noise.map(|noise| (100.0 + ramp + noise) as f32);
        frames.push(RowView {
            run: "a",
            press: -1,
            phase: Phase::Idle,
            t_ns,
            position_mm: [0.0, 0.0, 2.0],
            covering_mm: 1.0,
            indenter: "cyl1",
            temperature_c: None,
            counts: &counts,
        });
    }
    frames
}

#[test]
fn the_noise_is_that_of_one_reading_at_any_autocorrelation() {
    for phi in [0.0, 0.5, 0.8] {
        let frames = resting(phi);
        let noise = Noise::of(&frames, &still(&frames), 0.01).unwrap();
        assert!((noise.rms_counts - 3.0).abs() < 0.1, "{phi}: {}", noise.rms_counts);
        assert!((noise.correlation[1] - phi).abs() < 0.05, "{phi}: {:?}", noise.correlation);
    }
}

#[test]
fn a_mean_of_many_readings_is_as_uncertain_as_its_correlation_makes_it() {
    let frames = resting(0.5);
    let noise = Noise::of(&frames, &still(&frames), 0.01).unwrap();
    // Closed form: 1 + 2 phi/(1 - phi) - 2 phi (1 - phi^n) / (n (1 - phi)^2).
    let want = 1.0 + 2.0 - 2.0 * 0.5 * (1.0 - 0.5_f64.powi(10)) / (10.0 * 0.25);
    assert!((noise.inflation(10) - want).abs() < 0.2, "{} {want}", noise.inflation(10));
}

#[test]
fn without_repeated_frames_the_noise_comes_from_differences() {
    let mut frames = resting(0.0);
    for (index, at) in (0_u32..).zip(&mut frames.position_mm) {
        at[0] = f64::from(index);
    }
    assert!(Noise::of(&frames, &still(&frames), 0.01).is_none());
    let noise = Noise::of_differences(&frames, 0.01);
    assert!((noise.rms_counts - 3.0).abs() < 0.3, "{}", noise.rms_counts);
}

#[test]
fn the_bias_by_rounding_is_that_of_the_mean_of_many_rounded_readings() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for rms in [0.0, 0.1, 0.2, 0.35] {
        let mut square = 0.0;
        for offset in 0..200 {
            let signal = f64::from(offset) / 200.0;
            let mut reading = || {
                let noise: f64 = StandardNormal.sample(&mut rng);
                (signal + rms * noise).round() - signal
            };
            let mean: f64 = (0..4000).map(|_| reading()).sum::<f64>() / 4000.0;
            square += mean * mean / 200.0;
        }
        // A mean of 4000 readings is not free of noise itself.
        assert!((super::bias_variance(rms * rms, 1.0) - square).abs() < 3e-4, "{rms}: {square}");
    }
}

#[test]
fn noise_that_differs_by_chance_is_pooled_and_a_noisy_element_is_not() {
    let got = super::pooled(&[0.9, 1.0, 1.2, 1.1, 50.0], 0.5);
    let mean = (0.9 + 1.0 + 1.2 + 1.1) / 4.0;
    for (got, want) in got.into_iter().zip([mean, mean, mean, mean, 50.0]) {
        assert!((got - want).abs() < 1e-12, "{got}, not {want}");
    }
}

#[test]
fn differences_of_whole_counts_give_the_noise_of_a_reading() {
    for step_counts in [0.0, 1.0, 4.0] {
        let mut frames = resting(0.0);
        for counts in &mut frames.counts {
            *counts = if step_counts > 0.0 { (*counts / step_counts).round() * step_counts } else { *counts };
        }
        let noise = Noise::of_differences(&frames, f64::from(step_counts));
        let want = (9.0 + f64::from(step_counts).powi(2) / 12.0).sqrt();
        assert!((noise.rms_counts / want - 1.0).abs() < 0.02, "{} for {want}", noise.rms_counts);
    }
}
