use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::fit::Prepared;
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes};

/// Fits to many noises beside the truth: their mean error on the presses that were not fitted.
#[test]
fn the_error_that_is_expected_is_the_mean_error_of_fits() {
    let known = known();
    let silent = processes(ELEMENTS, 0.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(0));
    let truth = measured(&known, &[], &silent);
    let (mut expected, mut found) = (0.0, 0.0);
    for seed in 0..12 {
        let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(seed));
        let frames = measured(&known, &[], &noise);
        let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
        let problem = prepared.problem();
        expected += problem.estimation_error(&prepared.base).unwrap().unwrap();
        let bins = problem.predictor.bins;
        let (mut squares, mut readings) = (0.0, 0.0);
        let judged = (0..bins.len()).filter(|bin| bins.heldout[*bin] && bins.weight[*bin] > 0.0);
        for frame in judged.flat_map(|bin| (bins.first[bin]..bins.first[bin + 1]).map(move |one| (bin, one)))
        {
            let (bin, frame) = frame;
            let predicted = &prepared.base.predicted[bin * ELEMENTS..(bin + 1) * ELEMENTS];
            for (of, counts) in predicted.iter().zip(truth.counts_of(frame)) {
                squares += (of - f64::from(*counts)).powi(2) / prepared.noise.rms_counts.powi(2);
                readings += 1.0;
            }
        }
        found += squares / readings;
    }
    assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
}

/// The same of the fitted presses, each fold by a fit to the others.
#[test]
fn the_error_of_folds_is_that_of_fits_to_fewer_presses() {
    let known = known();
    let silent = processes(ELEMENTS, 0.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(0));
    let truth = measured(&known, &[], &silent);
    let (mut expected, mut found) = (0.0, 0.0);
    for seed in 0..12 {
        let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(seed));
        let frames = measured(&known, &[], &noise);
        let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
        let problem = prepared.problem();
        let folds = problem.by_folds(&prepared.base).unwrap().unwrap();
        expected += folds.estimation_error;
        let bins = problem.predictor.bins;
        let (mut squares, mut readings) = (0.0, 0.0);
        for bin in (0..bins.len()).filter(|bin| problem.train[*bin] > 0.0) {
            for frame in bins.first[bin]..bins.first[bin + 1] {
                for (element, counts) in truth.counts_of(frame).iter().enumerate() {
                    let place = bin * ELEMENTS + element;
                    let predicted = prepared.base.predicted[place] + folds.moved[place];
                    squares += (predicted - f64::from(*counts)).powi(2) / prepared.noise.rms_counts.powi(2);
                    readings += 1.0;
                }
            }
        }
        found += squares / readings;
    }
    assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
}
