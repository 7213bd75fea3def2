use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::fixtures::{ELEMENTS, found, known, measured};
use crate::{Discovery, Verdict};

const NOISE_COUNTS: f64 = 2.0;

/// What is found in presses of the base model with a noise that a function of the frame and the element makes larger.
fn discovered(seed: u64, growth: impl Fn(f64) -> f64) -> Discovery {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let known = known();
    let silent = vec![vec![0.0; ELEMENTS]; 30 * ELEMENTS];
    let clean = measured(&known, &[], &silent);
    let noise: Vec<Vec<f64>> = (0..30 * ELEMENTS)
        .map(|frame| {
            let of = |counts: &f32| -> f64 {
                let normal: f64 = StandardNormal.sample(&mut rng);
                NOISE_COUNTS * growth(f64::from(*counts) - 100.0) * normal
            };
            clean.counts_of(frame).iter().map(of).collect()
        })
        .collect();
    found(&known, &measured(&known, &[], &noise))
}

#[test]
fn noise_that_grows_with_the_signal_is_seen_and_not_named() {
    let found = discovered(5, |signal_counts| (1.0 + (signal_counts / 100.0).powi(2)).sqrt());
    assert!(found.steps.is_empty(), "{:?}", found.steps);
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert!(
        found.unexplained.depends_on.iter().any(|one| one.starts_with("noise that grows")),
        "{:?}",
        found.unexplained
    );
}

#[test]
fn noise_that_is_the_same_everywhere_is_not_seen() {
    for seed in 0..4 {
        let found = discovered(seed, |_| 1.0);
        assert_eq!(found.verdict, Verdict::NothingMissing, "seed {seed}: {:?}", found.global);
    }
}

#[test]
fn a_line_leaves_what_is_not_straight() {
    assert!(from_line([1.0, 2.0, 3.0, 4.0].into_iter()) < 1e-12);
    // Of 1, 0, 0, 1 from their mean of 1/2.
    assert!((from_line([1.0, 0.0, 0.0, 1.0].into_iter()) - 1.0).abs() < 1e-12);
    // The second difference of three values, squared, over 6.
    assert!((from_line([1.0, 5.0, 2.0].into_iter()) - 49.0 / 6.0).abs() < 1e-12);
}
