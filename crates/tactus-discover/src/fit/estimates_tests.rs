use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_schema::table::RowView;

use crate::Frames;
use crate::fit::Prepared;
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes};

/// Base models fitted to many noises: the mean square of the errors that is expected of each, and that which is found beside the truth. `unseen`
/// gives the expected one, the bins that are judged and what is predicted of all.
fn of_many_noises(unseen: impl Fn(&Prepared<'_>) -> (f64, Vec<bool>, Vec<f64>)) -> [f64; 2] {
    let known = known();
    let silent = processes(ELEMENTS, 0.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(0));
    let truth = measured(&known, &[], &silent);
    let (mut expected, mut found) = (0.0, 0.0);
    for seed in 0..12 {
        let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(seed));
        let frames = measured(&known, &[], &noise);
        let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
        let (of_one, judged, predicted) = unseen(&prepared);
        let first = &prepared.bins.first;
        let (mut squares, mut readings) = (0.0, 0.0);
        for (bin, predicted) in predicted.chunks_exact(ELEMENTS).enumerate().filter(|(bin, _)| judged[*bin]) {
            for frame in first[bin]..first[bin + 1] {
                for (of, counts) in predicted.iter().zip(truth.counts_of(frame)) {
                    squares += (of - f64::from(*counts)).powi(2) / prepared.noise.rms_counts.powi(2);
                    readings += 1.0;
                }
            }
        }
        expected += of_one;
        found += squares / readings;
    }
    [expected, found]
}

#[test]
fn the_error_that_is_expected_is_the_mean_error_of_fits() {
    let [expected, found] = of_many_noises(|prepared| {
        let (bins, base) = (&prepared.bins, &prepared.base);
        let judged = bins.heldout.iter().zip(&bins.weight).map(|(heldout, weight)| *heldout && *weight > 0.0);
        let expected = prepared.problem().estimation_error(base).unwrap().unwrap();
        (expected, judged.collect(), base.predicted.clone())
    });
    assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
}

/// The same of the fitted presses, each fold by a fit to the others.
#[test]
fn the_error_of_folds_is_that_of_fits_to_fewer_presses() {
    let [expected, found] = of_many_noises(|prepared| {
        let (problem, base) = (prepared.problem(), &prepared.base);
        let folds = problem.by_folds(base).unwrap().unwrap();
        let predicted = base.predicted.iter().zip(&folds.moved).map(|(of, moved)| of + moved);
        let judged = problem.train.iter().map(|weight| *weight > 0.0).collect();
        (folds.estimation_error, judged, predicted.collect())
    });
    assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
}

/// Presses of one place tell nothing of the spread, so that the base model has only gains and baselines.
#[test]
fn a_model_without_shared_numbers_has_the_errors_of_gains_and_baselines() {
    let known = known();
    let silent = processes(ELEMENTS, 0.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(0));
    let clean = measured(&known, &[], &silent);
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(3));
    let mut frames = Frames::new(ELEMENTS);
    for ((place, row), noise) in clean.rows().enumerate().zip(&noise) {
        let first = place % 30;
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts: Vec<f32> =
            clean.counts_of(first).iter().zip(noise).map(|(counts, noise)| counts + *noise as f32).collect();
        frames.push(RowView { position_mm: clean.position_mm[first], counts: &counts, ..row });
    }
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    assert!(problem.free(&prepared.base.parameters).is_empty());
    let held_out = problem.estimation_error(&prepared.base).unwrap().unwrap();
    let folds = problem.by_folds(&prepared.base).unwrap().unwrap().estimation_error;
    // A gain and a baseline for each of 32 presses of 30 frames, or of four fifths of them.
    assert!(held_out > 0.0 && folds > held_out && folds < 2.0 * held_out, "{held_out} {folds}");
}
