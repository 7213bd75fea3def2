use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Covariate;

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
