use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Covariate;
use tactus_model::effect::{Carrier, When};

use super::super::grammar::Atom;
use super::Sight;
use crate::fit::{Fitted, Prepared, RandomWalk};
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes};

/// A walk of 40 counts is a signal of 0.04 mm, far more than the elements have that are away from the tip.
#[test]
fn a_draft_does_not_see_a_walk_of_the_zeros() {
    let known = known();
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(3));
    let frames = measured(&known, &[], &noise);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let mut parameters = prepared.base.parameters.clone();
    let knots =
        (0..5).flat_map(|knot| (0..ELEMENTS).map(move |element| 10.0 * f64::from(knot) - element as f64));
    parameters.walk = Some(RandomWalk { knot_s: 40.0, runs: vec![knots.collect()] });
    let predicted = problem.predict(&parameters).unwrap();
    let walking = Fitted { parameters, predicted, ..prepared.base.clone() };
    let [without, with] = [&prepared.base, &walking].map(|at| Sight::of(&problem, at).unwrap());
    let most = |one: &[f64], other: &[f64]| {
        one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
    };
    assert!(most(&prepared.base.predicted, &walking.predicted) > 30.0);
    assert!(
        most(without.along(Covariate::Counts), with.along(Covariate::Counts)) < 1e-9,
        "{}",
        most(without.along(Covariate::Counts), with.along(Covariate::Counts))
    );
    assert!(most(without.along(Covariate::Signal), with.along(Covariate::Signal)) < 1e-9);
}

/// The hats of a value's knots make 1 together, so that a constant curve is one unit of its carrier wherever it acts.
#[test]
fn the_columns_of_an_atom_make_one_unit_together() {
    let known = known();
    let frames = measured(&known, &[], &vec![vec![0.0; ELEMENTS]; 30 * ELEMENTS]);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let sight = Arc::new(Sight::of(&problem, &prepared.base).unwrap());
    let acting = (Carrier::OwnSignal, When::InContact, Covariate::Depth);
    let atom = Atom::of(acting.0, acting.1, acting.2, sight.knots(acting, 5));
    let by_signal = sight.knots((acting.0, acting.1, Covariate::Signal), 4);
    let both = Atom {
        covariates: vec![Covariate::Depth, Covariate::Signal],
        knots: vec![atom.knots[0].clone(), by_signal],
        ..atom.clone()
    };
    let of_elements = Atom { of_elements: true, ..atom.clone() };
    let (unit, is_then) = (sight.unit_of(Carrier::OwnSignal), sight.is_then(When::InContact));
    for atom in [atom, both, of_elements] {
        let bins = problem.predictor.bins.len();
        let few = sight.acting(&atom, 0..bins);
        assert_eq!(few.len(), bins * ELEMENTS);
        for (reading, few) in few.iter().enumerate() {
            let wanted = if is_then[reading / ELEMENTS] { f64::from(unit[reading]) } else { 0.0 };
            let sum: f64 = few.each().map(|(_, value)| value).sum();
            assert!(
                (sum - wanted).abs() < 1e-9 * f64::from(unit[reading].abs().max(1.0)),
                "{atom:?} {reading}: {sum} {wanted}"
            );
            let own = atom.columns(1) * (reading % ELEMENTS);
            let may_be =
                if atom.of_elements { own..own + atom.columns(1) } else { 0..atom.columns(ELEMENTS) };
            assert!(few.each().all(|(column, _)| may_be.contains(&column)), "{atom:?} {reading}");
        }
    }
}
