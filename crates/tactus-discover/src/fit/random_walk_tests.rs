use nalgebra::{Cholesky, DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::fixtures::{ELEMENTS, INTERVAL_S, found, known, measured, processes};
use crate::{Verdict, predict};

const NOISE_COUNTS: f64 = 1.0;
const RMS_COUNTS: f64 = 1.5;
const TIME_S: f64 = 20.0;

fn sum(one: &[Vec<f64>], other: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let of = |(one, other): (&Vec<f64>, &Vec<f64>)| {
        one.iter().cycle().zip(other).map(|(one, other)| one + other).collect()
    };
    one.iter().zip(other).map(of).collect()
}

/// Mean square of the held-out readings' residuals, noise included, after the best interpolation: the mean of the process given
/// the fitted readings, with known covariance and noise.
fn kriging(readings: &[Vec<f64>], heldout: &[bool]) -> f64 {
    let which = |held: bool| (0..readings.len()).filter(|frame| heldout[*frame] == held).collect::<Vec<_>>();
    let (fitted, held) = (which(false), which(true));
    let covariance = |one: usize, other: usize| {
        RMS_COUNTS.powi(2) * (-(one.abs_diff(other) as f64) * INTERVAL_S / TIME_S).exp()
    };
    let among = DMatrix::from_fn(fitted.len(), fitted.len(), |i, j| {
        covariance(fitted[i], fitted[j]) + if i == j { NOISE_COUNTS.powi(2) } else { 0.0 }
    });
    let across = DMatrix::from_fn(held.len(), fitted.len(), |i, j| covariance(held[i], fitted[j]));
    let factors = Cholesky::new(among).unwrap();
    let squares = (0..ELEMENTS).map(|element| {
        let of = |frames: &[usize]| {
            DVector::from_iterator(frames.len(), frames.iter().map(|frame| readings[*frame][element]))
        };
        (of(&held) - &across * factors.solve(&of(&fitted))).norm_squared()
    });
    squares.sum::<f64>() / (held.len() * ELEMENTS) as f64
}

#[test]
fn random_walks_of_each_baseline_are_followed_nearly_as_well_as_possible() {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let walk = processes(ELEMENTS, RMS_COUNTS, TIME_S, &mut rng);
    let noise = processes(ELEMENTS, NOISE_COUNTS, 1e-3, &mut rng);
    let upon = sum(&walk, &noise);
    let frames = measured(&known, &[], &upon);
    let found = found(&known, &frames);
    let names: Vec<&str> = found.steps.iter().map(|step| step.effect).collect();
    assert_eq!(names, ["baseline-drift"]);
    assert_eq!(found.verdict, Verdict::Explained);
    let rate = found.steps[0].terms[0][0].value;
    // For times short beside the process's correlation time: sqrt(2 / T) rms.
    let want = (2.0 / TIME_S).sqrt() * RMS_COUNTS;
    assert!((rate / want - 1.0).abs() < 0.25, "{rate} {want}");
    let gap = |mean_square: f64| mean_square - NOISE_COUNTS.powi(2);
    let (before, after) = (found.base.heldout_rms_counts, found.final_.level.heldout_rms_counts);
    let best = kriging(&upon, &found.heldout_frames);
    let shrink = 1.0 - gap(after.powi(2)) / gap(before.powi(2));
    let oracle = 1.0 - gap(best) / gap(before.powi(2));
    assert!(shrink > 0.95 * oracle, "{shrink} {oracle}");

    // The effects alone predict the same.
    let predicted = predict(&known, &frames, &found.grown, &found.effects).unwrap();
    let squares: f64 = predicted
        .chunks_exact(ELEMENTS)
        .enumerate()
        .filter(|(frame, _)| found.heldout_frames[*frame])
        .flat_map(|(frame, counts)| counts.iter().zip(frames.counts_of(frame)))
        .map(|(counts, measured)| f64::from(measured - counts).powi(2))
        .sum();
    let readings = found.heldout_frames.iter().filter(|held| **held).count() * ELEMENTS;
    assert!(((squares / readings as f64).sqrt() - after).abs() < 0.02 * after);
}

#[test]
fn a_drift_common_to_all_elements_is_one_curve() {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let walk = processes(1, RMS_COUNTS, 2.0 * TIME_S, &mut rng);
    let noise = processes(ELEMENTS, NOISE_COUNTS, 1e-3, &mut rng);
    let found = found(&known, &measured(&known, &[], &sum(&walk, &noise)));
    assert_eq!(found.steps[0].effect, "baseline-drift");
    assert_eq!(found.steps[0].terms[0][2].name, "duration_s");
}

#[test]
fn coloured_noise_is_no_random_walk() {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let noise = processes(ELEMENTS, NOISE_COUNTS, 0.5, &mut rng);
    let found = found(&known, &measured(&known, &[], &noise));
    assert_eq!(found.verdict, Verdict::NothingMissing);
}
