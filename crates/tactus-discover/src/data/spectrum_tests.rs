use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_schema::table::{Phase, RowView};

use super::{lines_hz, transform};
use crate::data::Frames;

const ELEMENTS: usize = 4;
const RATE_HZ: f64 = 30.0;

/// Presses for so many frames each, and as many between them.
fn pressed(frames_of_presses: impl Iterator<Item = usize>) -> Frames {
    let mut frames = Frames::new(ELEMENTS);
    let mut is_down = false;
    for count in frames_of_presses {
        is_down = !is_down;
        for _ in 0..count {
            #[expect(clippy::cast_possible_truncation, reason = "some minutes")]
            let t_ns = (frames.len() as f64 / RATE_HZ * 1e9) as i64;
            frames.push(RowView {
                run: "a",
                press: if is_down { 0 } else { -1 },
                phase: if is_down { Phase::Hold } else { Phase::Idle },
                t_ns,
                position_mm: [0.0, 0.0, if is_down { -0.3 } else { 2.0 }],
                covering_mm: 1.016,
                indenter: "cyl1",
                temperature_c: None,
                counts: &[0.0; ELEMENTS],
            });
        }
    }
    frames
}

/// A residual of noise with a standard deviation of 1, plus `upon` at each time in s.
fn residual(frames: &Frames, rng: &mut ChaCha8Rng, upon: impl Fn(f64) -> f64) -> Vec<f64> {
    let of = |reading: usize| -> f64 {
        let noise: f64 = StandardNormal.sample(rng);
        noise + upon((reading / ELEMENTS) as f64 / RATE_HZ)
    };
    (0..frames.len() * ELEMENTS).map(of).collect()
}

/// Presses of irregular lengths have no rhythm, though the powers of their times differ from frequency to frequency.
#[test]
fn a_tone_is_found_at_any_frequency_where_presses_have_no_rhythm() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let lengths: Vec<usize> = (0..140).map(|_| rng.random_range(20..60)).collect();
    let frames = pressed(lengths.into_iter());
    let is_found = |hz: f64| {
        let residual = residual(&frames, &mut rng, |t_s| 0.35 * (TAU * hz * t_s).sin());
        lines_hz(&frames, &residual).first().is_some_and(|line| (line - hz).abs() < 0.005)
    };
    let found =
        (0..150).map(|step| 2.0 + 0.0731 * f64::from(step)).map(is_found).filter(|found| *found).count();
    assert!(found >= 149, "{found} of 150");
}

/// What repeats with the presses has lines at their rhythm, and is no tone.
#[test]
fn what_each_press_leaves_behind_is_no_tone() {
    let frames = pressed([23, 41].into_iter().cycle().take(160));
    let since_release_s = |t_s: f64| (t_s * RATE_HZ).rem_euclid(64.0) / RATE_HZ;
    let left = |t_s: f64| 3.0 * (-since_release_s(t_s)).exp();
    let residual = residual(&frames, &mut ChaCha8Rng::seed_from_u64(12), left);
    assert!(lines_hz(&frames, &residual).is_empty());
}

#[test]
fn the_transform_is_the_sum_that_defines_it() {
    let series: Vec<[f64; 2]> = (0..16).map(|k| [f64::from(k * k % 7), f64::from(k % 3)]).collect();
    let mut fast = series.clone();
    transform(&mut fast);
    for (frequency, [re, im]) in fast.iter().enumerate() {
        let (mut want_re, mut want_im) = (0.0, 0.0);
        for (time, [x, y]) in series.iter().enumerate() {
            let (sin, cos) = (-TAU * (frequency * time) as f64 / 16.0).sin_cos();
            want_re += x * cos - y * sin;
            want_im += x * sin + y * cos;
        }
        assert!((re - want_re).abs() < 1e-9 && (im - want_im).abs() < 1e-9, "{frequency}");
    }
}
