use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Effect;

use super::*;
use crate::data::{Frames, Known};
use crate::fit::{Prepared, Term};
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes};

fn hardening() -> Effect {
    Effect::new("hardening", [("growth_at_1_mm", 0.5), ("exponent", 2.0), ("own_share", 0.0)]).unwrap()
}

/// Presses of a sensor with that effect, and white noise of one count.
fn hardened(known: &Known, seed: u64) -> Frames {
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(seed));
    measured(known, &[hardening()], &noise)
}

/// The press of each bin, counted from 0 among those with fitted bins.
fn presses(problem: &Problem<'_>) -> Vec<Option<usize>> {
    let bins = problem.predictor.bins;
    let mut seen = Vec::new();
    let mut press_of = |bin: usize| {
        let key = (bins.run[bin], problem.predictor.frames.press[bins.first[bin]]);
        let is_fitted = problem.train[bin] > 0.0;
        if is_fitted && seen.last() != Some(&key) {
            seen.push(key);
        }
        is_fitted.then(|| seen.len() - 1)
    };
    (0..bins.len()).map(&mut press_of).collect()
}

/// Each fold by itself: a fit to the other presses, without any approximation, then its residual.
#[test]
fn what_is_left_is_what_fits_to_the_other_presses_leave() {
    let (known, hidden) = (known(), hardening());
    let frames = hardened(&known, 5);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let at = problem.fit_from(prepared.base.parameters.with(Term::of(&hidden)), 12).unwrap();
    let left = problem.left_by_folds(&at).unwrap().unwrap();
    let press = presses(&problem);
    let bins = problem.predictor.bins;
    let mut press_of_blocks: Vec<(usize, usize)> =
        press.iter().zip(&bins.block).filter_map(|(press, block)| Some((*block, (*press)?))).collect();
    press_of_blocks.dedup();
    assert_eq!(left.len(), press_of_blocks.len());
    assert!(press.iter().flatten().max().is_some_and(|last| *last >= 2 * FOLDS));
    for fold in 0..FOLDS {
        let is_in = |bin: usize| press[bin].is_some_and(|press| press % FOLDS == fold);
        let mut others = prepared.problem();
        for (bin, weight) in others.train.iter_mut().enumerate() {
            *weight *= f64::from(u8::from(!is_in(bin)));
        }
        let fitted = others.fit_from(at.parameters.clone(), 12).unwrap();
        let weights = problem.weights().zip(problem.residuals(&fitted.predicted)).enumerate();
        let squares = weights.filter(|(place, _)| is_in(place / ELEMENTS));
        let wanted: f64 = squares.map(|(_, (weight, residual))| weight * residual * residual).sum();
        let of_blocks = left.iter().zip(&press_of_blocks);
        let found: f64 =
            of_blocks.filter(|(_, (_, press))| press % FOLDS == fold).map(|(left, _)| left).sum();
        assert!((found - wanted).abs() < 2e-3 * wanted, "fold {fold}: {found} {wanted}");
    }
}

#[test]
fn presses_that_a_fit_has_not_seen_are_further_from_it_and_a_true_effect_gains_on_them() {
    let (known, hidden) = (known(), hardening());
    let frames = hardened(&known, 6);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let with = problem.fit_from(prepared.base.parameters.with(Term::of(&hidden)), 12).unwrap();
    let left: f64 = problem.left_by_folds(&with).unwrap().unwrap().iter().sum();
    assert!(left > with.cost, "{left} {}", with.cost);
    let [base, with] = [&prepared.base, &with].map(|at| problem.left_by_folds(at).unwrap().unwrap());
    let gains = gains_by_folds(&base, &with);
    let gained = gains.iter().filter(|gain| **gain > 0.0).count();
    assert!(2 * gained > gains.len(), "{gained} of {}", gains.len());
}

#[test]
fn blocks_without_contact_do_not_set_how_much_a_press_counts() {
    let mut more = vec![0.1; 20];
    more.extend([0.0, -30.0, -50.0, -1000.0]);
    let gains = gains_by_folds(&[0.0; 24], &more);
    // The median of the three that tell something is 50.
    let most = 4.0 * 1.4826 * 50.0;
    assert!((gains[22] - 50.0).abs() < 1e-12 && (gains[23] / most - 1.0).abs() < 1e-3, "{gains:?}");
}
