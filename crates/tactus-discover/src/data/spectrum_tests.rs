use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_schema::table::{Phase, RowView};

use super::{Line, lines, lines_in_contact, transform};
use crate::data::Frames;
use crate::data::bins::{Averaged, Bins};

const ELEMENTS: usize = 16;
const COLUMNS: usize = 4;
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

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousands")]
fn frame_at(t_s: f64) -> usize {
    (t_s * RATE_HZ).round() as usize
}

/// A residual of noise with a standard deviation of 1, plus `upon` at each time in s and element.
fn residual(frames: &Frames, rng: &mut ChaCha8Rng, upon: impl Fn(f64, usize) -> f64) -> Vec<f64> {
    let of = |reading: usize| -> f64 {
        let noise: f64 = StandardNormal.sample(rng);
        noise + upon((reading / ELEMENTS) as f64 / RATE_HZ, reading % ELEMENTS)
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
        let residual = residual(&frames, &mut rng, |t_s, _| 0.35 * (TAU * hz * t_s).sin());
        let lines = lines(&frames, COLUMNS, &residual);
        lines.first().is_some_and(|line| (line.frequency_hz - hz).abs() < 0.005)
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
    let left = |t_s: f64, _| 3.0 * (-since_release_s(t_s)).exp();
    let residual = residual(&frames, &mut ChaCha8Rng::seed_from_u64(12), left);
    let lines = lines(&frames, COLUMNS, &residual);
    assert!(lines.is_empty(), "{lines:?}");
}

/// A tenth of the noise of an element: the powers of elements do not tell it, their sum does.
#[test]
fn a_faint_tone_of_all_elements_is_found_with_its_phase() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let lengths: Vec<usize> = (0..140).map(|_| rng.random_range(20..60)).collect();
    let frames = pressed(lengths.into_iter());
    for phase_per_column_deg in [0.0, 45.0, -90.0, 135.0] {
        let phase = |element: usize| (element % COLUMNS) as f64 * f64::to_radians(phase_per_column_deg);
        let tone = |t_s: f64, element| 0.1 * (TAU * 7.3 * t_s + phase(element)).sin();
        let found = lines(&frames, COLUMNS, &residual(&frames, &mut rng, tone));
        let [Line { frequency_hz, phase_per_column_deg: found_deg }] = found[..] else {
            panic!("{phase_per_column_deg} degrees: {found:?}")
        };
        assert!((frequency_hz - 7.3).abs() < 0.01, "{frequency_hz}");
        assert!((found_deg - phase_per_column_deg).abs() < 1e-9, "{found_deg} for {phase_per_column_deg}");
    }
}

/// The stage carries the mains into the array: it shows while the tool touches, and nowhere else.
#[test]
fn a_tone_in_contact_is_found_in_contact_alone() {
    let mut rng = ChaCha8Rng::seed_from_u64(15);
    let lengths: Vec<usize> = (0..140).map(|_| rng.random_range(20..60)).collect();
    let frames = pressed(lengths.into_iter());
    for hz in [1.3, 4.7, 11.2] {
        let touches = |t_s: f64| frames.position_mm[frame_at(t_s)][2] < 0.0;
        let tone = |t_s: f64, _| if touches(t_s) { 0.35 * (TAU * hz * t_s).sin() } else { 0.0 };
        let residual = residual(&frames, &mut rng, tone);
        let found = lines_in_contact(&frames, COLUMNS, &residual);
        assert!(found.first().is_some_and(|line| (line.frequency_hz - hz).abs() < 0.01), "{hz}: {found:?}");
        assert!(lines(&frames, COLUMNS, &residual).is_empty(), "{hz}");
    }
}

/// What a press relaxes by is alike from press to press, and no tone; nor is noise.
#[test]
fn presses_that_relax_have_no_lines() {
    let mut rng = ChaCha8Rng::seed_from_u64(16);
    let lengths: Vec<usize> = (0..140).map(|_| rng.random_range(20..60)).collect();
    let frames = pressed(lengths.into_iter());
    let since: Vec<f64> = {
        let mut begin = 0;
        let is_down = |frame: usize| frames.position_mm[frame][2] < 0.0;
        let of = |frame: usize| {
            if frame > 0 && is_down(frame) != is_down(frame - 1) {
                begin = frame;
            }
            (frame - begin) as f64 / RATE_HZ
        };
        (0..frames.len()).map(of).collect()
    };
    for relaxes_by in [0.0, 3.0] {
        let left = |t_s: f64, _| relaxes_by * (-since[frame_at(t_s)] / 0.3).exp();
        let with_lines = (0..20)
            .filter(|_| !lines_in_contact(&frames, COLUMNS, &residual(&frames, &mut rng, left)).is_empty());
        let with_lines = with_lines.count();
        assert!(with_lines <= 2, "{with_lines} of 20 that relax by {relaxes_by}");
    }
}

/// One recording in fifty, of noise alone or with a slow drift that all elements have together.
#[test]
fn noise_has_no_lines() {
    let mut rng = ChaCha8Rng::seed_from_u64(14);
    let lengths: Vec<usize> = (0..140).map(|_| rng.random_range(20..60)).collect();
    let frames = pressed(lengths.into_iter());
    for drift in [0.0, 0.3] {
        let slow = |t_s: f64, _| drift * (0.03 * t_s).sin();
        let with_lines =
            (0..30).filter(|_| !lines(&frames, COLUMNS, &residual(&frames, &mut rng, slow)).is_empty());
        let with_lines = with_lines.count();
        assert!(with_lines <= 3, "{with_lines} of 30 with a drift of {drift}");
    }
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

/// What recovers after each press leaks through the gaps that presses make, to all frequencies.
#[test]
fn what_recovers_after_presses_has_no_tone_that_averages_lose() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let lengths: Vec<usize> = (0..140).map(|_| rng.random_range(20..60)).collect();
    let frames = pressed(lengths.iter().copied());
    let mut since_s: Vec<f64> = Vec::new();
    for count in &lengths {
        since_s.extend((0..*count).map(|frame| frame as f64 / RATE_HZ));
    }
    let bins = Bins::of(&frames, Averaged::Rests).unwrap();
    let recovers = |t_s: f64, element: usize| {
        let since_s = since_s[frame_at(t_s)];
        20.0 * (1.0 + (element as f64).sin()) * (-since_s / 0.4).exp()
    };
    let all = residual(&frames, &mut rng, recovers);
    assert!(!lines(&frames, COLUMNS, &all).is_empty(), "these are no tones");
    assert_eq!(lines(&frames, COLUMNS, &bins.averaged_out(all)), []);
    let hums = |t_s: f64, element: usize| recovers(t_s, element) + 0.7 * (TAU * 4.3 * t_s).sin();
    let found = lines(&frames, COLUMNS, &bins.averaged_out(residual(&frames, &mut rng, hums)));
    assert!(found.first().is_some_and(|line| (line.frequency_hz - 4.3).abs() < 0.01), "{found:?}");
}
