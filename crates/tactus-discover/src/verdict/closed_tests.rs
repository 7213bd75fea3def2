use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;

const PRESSES: usize = 40;
const FRAMES: usize = 50;
const ELEMENTS: usize = 12;

/// Residuals before and after a model that closes a share of a structure of this size, in white noise of 1 count.
fn residuals(rms: f64, closes: f64, seed: u64) -> [Vec<f32>; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut both = [Vec::new(), Vec::new()];
    for _ in 0..PRESSES {
        let [explained, left] = [closes, 1.0 - closes].map(|share: f64| {
            let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            side * rms * share.sqrt()
        });
        for _ in 0..FRAMES * ELEMENTS {
            let noise: f64 = StandardNormal.sample(&mut rng);
            #[expect(clippy::cast_possible_truncation, reason = "residuals are stored so")]
            [explained + left, left]
                .iter()
                .zip(&mut both)
                .for_each(|(of, into)| into.push((of + noise) as f32));
        }
    }
    both
}

/// The share that is seen if the noise is believed to be of this size.
fn seen(residuals: &[Vec<f32>; 2], noise: f64) -> Closed {
    let presses: Vec<Range<usize>> = (0..PRESSES).map(|press| press * FRAMES..(press + 1) * FRAMES).collect();
    let (noise_counts, unit_counts) = ([noise; ELEMENTS], [1.0; ELEMENTS]);
    let signal = vec![0.0; residuals[0].len()];
    let readings = |residual| Readings {
        elements: ELEMENTS,
        residual,
        signal: &signal,
        presses: &presses,
        noise_counts: &noise_counts,
        unit_counts: &unit_counts,
        lag: 1,
        correlation: 0.0,
        rounding_share: 0.0,
        freedom: 500.0,
    };
    closed([&readings(&residuals[0]), &readings(&residuals[1])], 0.0, |_| true).unwrap()
}

#[test]
fn the_share_of_a_gap_far_below_the_noise_is_seen_though_the_size_of_the_noise_is_not_exact() {
    for (closes, seed) in [(1.0, 1), (0.8, 2), (0.5, 3), (0.2, 4)] {
        for noise in [0.98, 1.0, 1.02] {
            let Closed { share, standard_error, .. } = seen(&residuals(0.2, closes, seed), noise);
            let error = standard_error.unwrap();
            assert!((share - closes).abs() < (4.0 * error).max(0.12), "{closes} {noise}: {share} +- {error}");
            assert!(error < 0.2, "{closes} {noise}: {error}");
        }
    }
}

#[test]
fn what_changes_too_fast_to_last_counts_once_it_is_certain() {
    let [before, mut after] = residuals(2.0, 1.0, 5);
    // What is left turns its sign from frame to frame.
    for (place, value) in after.iter_mut().enumerate() {
        *value += if (place / ELEMENTS).is_multiple_of(2) { 2.0 } else { -2.0 };
    }
    let Closed { share, most, .. } = seen(&[before, after], 1.0);
    assert!(share < 0.6, "{share}");
    assert!(most >= 1.0, "nothing of it lasts: {most}");
}

#[test]
fn the_most_that_a_model_may_close_is_less_than_it_leaves_room_for() {
    for (closes, seed) in [(0.8, 6), (0.5, 7), (0.2, 8)] {
        let Closed { share, standard_error, most } = seen(&residuals(2.0, closes, seed), 1.0);
        let error = standard_error.unwrap();
        assert!((most - share - 2.0 * error).abs() < error, "{closes}: {share} +- {error}, at most {most}");
        assert!(most < closes + 5.0 * error && most > closes, "{closes}: {most}");
    }
}

/// The error by its definition: the share of all presses but one, for each in turn.
#[test]
fn the_error_is_that_of_the_shares_without_each_press() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut draw = || f64::from(rng.random_range(1..1000_u32)) / 1000.0;
    let presses: Vec<OfPress> =
        (0..40).map(|_| [[draw(), 600.0], [0.3 * draw(), 500.0], [draw(), 600.0]]).collect();
    let parts = |of: &OfPress| {
        let [closed, left, _] = of.map(|[sum, count]| sum / count);
        Parts { closed, left }
    };
    let of_all = |presses: &[OfPress]| {
        let mut sums = OfPress::default();
        for (which, k) in (0..3).flat_map(|which| [(which, 0), (which, 1)]) {
            sums[which][k] = presses.iter().map(|press| press[which][k]).sum();
        }
        let Parts { closed, left } = parts(&sums);
        closed / (closed + left)
    };
    let without = |press: usize| of_all(&[&presses[..press], &presses[press + 1..]].concat());
    let shares: Vec<f64> = (0..presses.len()).map(without).collect();
    let mean = shares.iter().sum::<f64>() / 40.0;
    let want = (shares.iter().map(|one| (one - mean).powi(2)).sum::<f64>() * 39.0 / 40.0).sqrt();
    let (whole, error) = with_error(&presses, parts).unwrap();
    assert!((whole - of_all(&presses)).abs() < 1e-12);
    assert!((error.unwrap() / want - 1.0).abs() < 0.05, "{error:?} {want}");
}

/// Of a structure of 0.05 of the noise nothing is left, and the noise makes that seem less than nothing as often as more.
#[test]
fn the_error_of_a_share_of_all_is_that_of_the_noise() {
    let shares: Vec<Closed> = (100..160).map(|seed| seen(&residuals(0.05, 1.0, seed), 1.0)).collect();
    let whole = shares.iter().filter(|one| one.share >= 1.0).count();
    assert!((15..45).contains(&whole), "{whole}");
    let is_told =
        |one: &&Closed| one.standard_error.is_some_and(|error| 1.0 - one.share < 3.0 * error && error > 0.03);
    let told = shares.iter().filter(is_told).count();
    assert!(told >= 55, "{told}: {shares:?}");
}

/// Long presses leave nothing, short ones all: of as many readings each.
#[test]
fn a_press_weighs_by_its_readings() {
    let mut presses: Vec<Range<usize>> = (0..20).map(|press| press * 60..(press + 1) * 60).collect();
    presses.extend((0..100).map(|press| 1200 + press * 12..1200 + (press + 1) * 12));
    let of = |long: f32, short: f32| -> Vec<f32> {
        (0..2400 * ELEMENTS).map(|place| if place < 1200 * ELEMENTS { long } else { short }).collect()
    };
    let (before, after) = (of(2.0, 2.0), of(0.0, 2.0));
    let signal = vec![0.0; before.len()];
    let noise = [1e-6; ELEMENTS];
    let readings = |residual| Readings {
        elements: ELEMENTS,
        residual,
        signal: &signal,
        presses: &presses,
        noise_counts: &noise,
        unit_counts: &[1.0; ELEMENTS],
        lag: 1,
        correlation: 0.0,
        rounding_share: 0.0,
        freedom: 500.0,
    };
    let Closed { share, .. } = closed([&readings(&before), &readings(&after)], 0.0, |_| true).unwrap();
    assert!((share - 0.5).abs() < 1e-6, "{share}");
}

/// As many as there are frames in a recording of presses of one frame each.
#[test]
fn the_error_of_many_presses_takes_no_time() {
    let presses: Vec<OfPress> =
        (0..300_000).map(|press| [[f64::from(press % 7), 48.0], [1.0, 48.0], [1.0, 48.0]]).collect();
    let parts = |of: &OfPress| Parts { closed: of[0][0], left: of[1][0] };
    let (_, error) = with_error(&presses, parts).unwrap();
    assert!(error.is_some_and(|error| error > 0.0 && error < 1e-2), "{error:?}");
}
