use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::fixtures::{ELEMENTS, found, known, measured, processes};
use crate::{Discovery, Verdict};

const NOISE_COUNTS: f64 = 1.0;

/// A discovery in data of the base model, to which `more` adds counts: of the signals of a frame, and of its greatest.
fn with(more: impl Fn(&[f64], f64) -> Vec<f64>) -> Discovery {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let clean = measured(&known, &[], &processes(ELEMENTS, 0.0, 1e-3, &mut rng));
    let mut upon = processes(ELEMENTS, NOISE_COUNTS, 1e-3, &mut rng);
    for (frame, upon) in upon.iter_mut().enumerate() {
        let signal: Vec<f64> = clean.counts_of(frame).iter().map(|counts| f64::from(*counts) - 100.0).collect();
        let depth_mm = -clean.position_mm[frame][2];
        upon.iter_mut().zip(more(&signal, depth_mm)).for_each(|(upon, more)| *upon += more);
    }
    found(&known, &measured(&known, &[], &upon))
}

fn covariates(found: &Discovery) -> Vec<&'static str> {
    found.gap.iter().map(|gap| gap.covariate).collect()
}

#[test]
fn elements_that_differ_at_some_depths_are_seen_as_such() {
    let found = with(|signal, depth_mm| {
        let of = |(element, signal): (usize, &f64)| match (element % 6, depth_mm > 0.37) {
            (1, true) => 0.15 * signal,
            (4, true) => -0.15 * signal,
            _ => 0.0,
        };
        signal.iter().enumerate().map(of).collect()
    });
    assert!(covariates(&found).contains(&"element and depth"), "{:?}", found.gap);
    assert_ne!(found.verdict, Verdict::NothingMissing);
    assert!(found.gap.iter().all(|gap| gap.covariate != "element"), "gains are fitted: {:?}", found.gap);
}

#[test]
fn a_supply_that_droops_with_the_sum_of_signals_is_seen_as_such() {
    let found = with(|signal, _| {
        let sum: f64 = signal.iter().sum();
        signal.iter().map(|signal| -2e-4 * sum * signal).collect()
    });
    assert!(covariates(&found).contains(&"sum of signals"), "{:?}", found.gap);
}
