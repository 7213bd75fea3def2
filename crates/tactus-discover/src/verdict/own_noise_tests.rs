use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::fixtures::{OPTIONS, known, measured, processes};

const COLS: usize = 6;
const ELEMENTS: usize = 48;
const WINDOWS: usize = 80;
const FRAMES: usize = WINDOWS * WINDOW_FRAMES;

/// Each element's own noise with a memory, plus a disturbance from the frame and the element.
fn tested(seed: u64, rms_counts: f64, step_counts: f64, upon: impl Fn(usize, usize) -> f64) -> Scattered {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut now = [0.0_f64; ELEMENTS];
    let mut residual = Vec::new();
    for frame in 0..FRAMES {
        for (element, now) in now.iter_mut().enumerate() {
            let normal: f64 = StandardNormal.sample(&mut rng);
            *now = 0.6 * *now + 0.8 * rms_counts * (1.0 + 0.01 * element as f64) * normal;
            let counts = (*now + upon(frame, element)) / step_counts;
            #[expect(clippy::cast_possible_truncation, reason = "residuals are stored so")]
            residual.push((counts.round() * step_counts) as f32);
        }
    }
    let signal: Vec<f32> = (0..FRAMES * ELEMENTS).map(|place| signal(place % ELEMENTS)).collect();
    let windows: Vec<_> =
        (0..WINDOWS).map(|window| window * WINDOW_FRAMES..(window + 1) * WINDOW_FRAMES).collect();
    let at_rest = AtRest {
        elements: ELEMENTS,
        cols: COLS,
        residual: &residual,
        signal: &signal,
        windows: &windows,
        singles: &(1..FRAMES - 1).collect::<Vec<_>>(),
        noise_counts: &[rms_counts; ELEMENTS],
        step_counts,
    };
    at_rest.shared_or_far_out()
}

fn signal(element: usize) -> f32 {
    if element.is_multiple_of(5) { 100.0 } else { 1.0 }
}

#[test]
fn own_noise_gives_small_p_values_no_more_often_than_they_say() {
    for step_counts in [1e-3, 3.0] {
        let small = (0..200).filter(|seed| tested(*seed, 1.0, step_counts, |_, _| 0.0).p_value <= 0.05);
        // More than 18 of 200 have a probability of 0.6 % where each has one of 5 %.
        assert!(small.count() <= 18, "{step_counts}");
    }
}

#[test]
fn what_elements_share_is_seen_with_its_pattern() {
    let mut rng = ChaCha8Rng::seed_from_u64(77);
    let draws: Vec<f64> = (0..FRAMES).map(|_| StandardNormal.sample(&mut rng)).collect();
    let of = |upon: &dyn Fn(usize, usize) -> f64| tested(5, 1.0, 0.5, upon);
    let hum = of(&|frame, _| 0.3 * (TAU * 0.13 * frame as f64).sin());
    let row = of(&|frame, element| if element / COLS == 2 { 0.5 * draws[frame] } else { 0.0 });
    let column = of(&|frame, element| if element % COLS == 4 { 0.5 * draws[frame] } else { 0.0 });
    let gain = of(&|frame, element| 0.003 * f64::from(signal(element)) * draws[frame]);
    assert_eq!(
        [hum.with, row.with, column.with, gain.with],
        Pattern::ALL.map(Pattern::name),
        "{hum:?} {row:?} {column:?} {gain:?}"
    );
    assert!(
        [hum, row, column, gain].iter().all(|one| one.p_value < 1e-3),
        "{hum:?} {row:?} {column:?} {gain:?}"
    );
}

#[test]
fn one_reading_far_out_is_seen_and_slow_changes_are_not() {
    let mut rng = ChaCha8Rng::seed_from_u64(78);
    let at = (FRAMES / 2 + 7, rng.random_range(0..ELEMENTS));
    let flipped = tested(6, 1.0, 0.5, |frame, element| if (frame, element) == at { 16.0 } else { 0.0 });
    assert_eq!(flipped.with, "single readings");
    assert!(flipped.p_value < 1e-6, "{flipped:?}");
    let slow = tested(6, 1.0, 0.5, |frame, _| 20.0 * (TAU * frame as f64 / 600.0).sin());
    assert!(slow.p_value > 0.01, "{slow:?}");
}

#[test]
fn one_reading_far_out_is_seen_while_the_tool_goes_down() {
    let known = known();
    let mut upon = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(79));
    let tested = |upon: &[Vec<f64>]| {
        let frames = measured(&known, &[], upon);
        let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
        // The third of five frames on the way down, of a press that is fitted.
        let frame =
            (0..ELEMENTS).map(|press| 30 * press + 7).find(|frame| !prepared.heldout.frames[*frame]).unwrap();
        (prepared.own_noise(&prepared.residual(&prepared.base.parameters).unwrap()), frame)
    };
    let (whole, frame) = tested(&upon);
    assert!(whole.p_value > 0.01, "{whole:?}");
    upon[frame][20] += 16.0;
    let (flipped, _) = tested(&upon);
    assert_eq!(flipped.with, "single readings");
    assert!(flipped.p_value < 1e-6, "{flipped:?}");
}

#[test]
fn without_windows_nothing_is_tested() {
    let at_rest = AtRest {
        elements: 1,
        cols: 1,
        residual: &[],
        signal: &[],
        windows: &[],
        singles: &[],
        noise_counts: &[1.0],
        step_counts: 1.0,
    };
    assert!(at_rest.shared_or_far_out().p_value >= 1.0);
}
