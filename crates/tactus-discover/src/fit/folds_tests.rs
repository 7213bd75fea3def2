use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Effect;
use tactus_model::effect::{Definition, Knots};

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
    let left = problem.left_by_folds(&at, FoldsOf::Presses).unwrap().unwrap();
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

/// The models of the folds against fits to the other presses that approximate nothing, on the presses of each fold.
#[test]
fn each_press_is_predicted_as_by_a_fit_to_the_others() {
    let (known, hidden) = (known(), hardening());
    let frames = hardened(&known, 5);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let at = problem.fit_from(prepared.base.parameters.with(Term::of(&hidden)), 12).unwrap();
    let ByFolds { moved, .. } = problem.by_folds(&at).unwrap().unwrap();
    let press = presses(&problem);
    for fold in 0..FOLDS {
        let is_in = |bin: usize| press[bin].is_some_and(|press| press % FOLDS == fold);
        let mut others = prepared.problem();
        for (bin, weight) in others.train.iter_mut().enumerate() {
            *weight *= f64::from(u8::from(!is_in(bin)));
        }
        let wanted = others.fit_from(at.parameters.clone(), 12).unwrap().predicted;
        let places = (0..moved.len()).filter(|place| is_in(place / ELEMENTS));
        let [apart, all] = places.fold([0.0; 2], |[apart, all], place| {
            let wanted = wanted[place] - at.predicted[place];
            [apart + (moved[place] - wanted).powi(2), all + wanted.powi(2)]
        });
        assert!(apart < 0.01 * all, "fold {fold}: {apart} of {all}");
    }
    let held_out = (0..moved.len()).filter(|place| problem.predictor.bins.heldout[place / ELEMENTS]);
    assert!(held_out.map(|place| moved[place]).all(|moved| moved == 0.0));
}

#[test]
fn presses_that_a_fit_has_not_seen_are_further_from_it_and_a_true_effect_gains_on_them() {
    let (known, hidden) = (known(), hardening());
    let frames = hardened(&known, 6);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let with = problem.fit_from(prepared.base.parameters.with(Term::of(&hidden)), 12).unwrap();
    let left: f64 = problem.left_by_folds(&with, FoldsOf::Presses).unwrap().unwrap().iter().sum();
    assert!(left > with.cost, "{left} {}", with.cost);
    let [base, with] =
        [&prepared.base, &with].map(|at| problem.left_by_folds(at, FoldsOf::Presses).unwrap().unwrap());
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

/// A gain that jumps between presses, so that no press tells the next one's.
fn drifted(known: &Known, seed: u64) -> (Frames, Term) {
    let jumps = [0.0, 0.06, -0.04, 0.05, 0.08, -0.03, 0.04, -0.06, 0.07, 0.01];
    let at_s = (1..=jumps.len()).map(|knot| 8.0 * knot as f64).collect();
    let knots = Knots { at: at_s, values: jumps.to_vec() };
    let effect =
        Effect::of_knots(Definition::find("gain-drift").unwrap(), [("rate_per_k", 0.0)], knots).unwrap();
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(seed));
    (measured(known, std::slice::from_ref(&effect), &noise), Term::of(&effect))
}

/// What is left of elements by folds, and what each fold by itself leaves: a fit to the other elements, without any approximation, then
/// gains and baselines of its own by a straight line.
fn left_by_both(problem: &Problem<'_>, at: &Fitted) -> [f64; 2] {
    let left: f64 = problem.left_by_folds(at, FoldsOf::Elements).unwrap().unwrap().iter().sum();
    let mut wanted = 0.0;
    for fold in 0..FOLDS {
        let others = problem.of_elements(|element| element % FOLDS != fold);
        let fitted = others.fit_from(at.parameters.clone(), 12).unwrap();
        for element in (0..ELEMENTS).filter(|element| element % FOLDS == fold) {
            // Weights, what the fit predicts and what was read, of the fitted bins.
            let bins = (0..problem.predictor.bins.len()).filter(|bin| problem.train[*bin] > 0.0);
            let reading = |bin: usize| {
                let place = bin * ELEMENTS + element;
                let weight = problem.train[bin] * problem.element_weight[element];
                [weight, fitted.predicted[place], problem.predictor.bins.counts[place]]
            };
            let readings: Vec<[f64; 3]> = bins.map(reading).collect();
            let sum =
                |of: &dyn Fn(&[f64; 3]) -> f64| readings.iter().map(|one| one[0] * of(one)).sum::<f64>();
            let all = sum(&|_| 1.0);
            let [x, y] = [1, 2].map(|column: usize| sum(&|one| one[column]) / all);
            let xx = sum(&|one| (one[1] - x).powi(2));
            let xy = sum(&|one| (one[1] - x) * (one[2] - y));
            let yy = sum(&|one| (one[2] - y).powi(2));
            wanted += yy - if xx > 0.0 { xy * xy / xx } else { 0.0 };
        }
    }
    [left, wanted]
}

#[test]
fn what_is_left_of_elements_is_what_a_fit_to_the_others_leaves_of_them() {
    let known = known();
    let (frames, term) = drifted(&known, 7);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let at = problem.fit_from(prepared.base.parameters.with(term), 12).unwrap();
    let [left, wanted] = left_by_both(&problem, &at);
    assert!((left - wanted).abs() < 2e-3 * wanted, "{left} {wanted}");
}

#[test]
fn a_gain_that_jumps_from_press_to_press_is_confirmed_by_elements() {
    let known = known();
    let (frames, term) = drifted(&known, 8);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let with = problem.fit_from(prepared.base.parameters.with(term), 12).unwrap();
    let left = |at: &Fitted| problem.left_by_folds(at, FoldsOf::Elements).unwrap().unwrap();
    let gains = gains_by_folds(&left(&prepared.base), &left(&with));
    let (gained, lost): (f64, f64) =
        gains.iter().fold((0.0, 0.0), |(gained, lost), gain| (gained + gain.max(0.0), lost - gain.min(0.0)));
    assert!(gained > 4.0 * lost, "{gained} {lost}");
}

#[test]
fn a_wire_that_one_fold_shows_is_a_parameter_of_all() {
    let known = known();
    let (frames, term) = drifted(&known, 9);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let wire = Effect::new(
        "miswired",
        [("element", 7.0), ("answers_for", 8.0), ("own_share", 0.9), ("other_share", 0.1)],
    );
    let with = prepared.base.parameters.with(term).with(Term::of(&wire.unwrap()));
    let at = problem.fit_from(with, 12).unwrap();
    // A fit to the other elements does not see the wire, and leaves its shares as they are.
    let [left, wanted] = left_by_both(&problem, &at);
    assert!((left - wanted).abs() < 2e-3 * wanted, "{left} {wanted}");
}
