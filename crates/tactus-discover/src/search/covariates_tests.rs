use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::Gap;
use crate::fit::Prepared;
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes, search};
use crate::progress::Reporter;
use crate::search::grow::ALPHA;

const NOISE_COUNTS: f64 = 1.0;

/// Where data of the base model disagree with it, to which `more` adds counts: of the signals of a frame, and of its depth.
fn gap(more: impl Fn(&[f64], f64) -> Vec<f64>) -> Vec<Gap> {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let clean = measured(&known, &[], &processes(ELEMENTS, 0.0, 1e-3, &mut rng));
    let mut upon = processes(ELEMENTS, NOISE_COUNTS, 1e-3, &mut rng);
    for (frame, upon) in upon.iter_mut().enumerate() {
        let signal: Vec<f64> =
            clean.counts_of(frame).iter().map(|counts| f64::from(*counts) - 100.0).collect();
        let depth_mm = -clean.position_mm[frame][2];
        upon.iter_mut().zip(more(&signal, depth_mm)).for_each(|(upon, more)| *upon += more);
    }
    let frames = measured(&known, &[], &upon);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let problem = prepared.problem();
    let reporter = Reporter::new(&|_| {});
    let search = search(&problem, &[], &reporter);
    let located = search.locate(&prepared.base).unwrap();
    assert!(located.p_value <= ALPHA, "{}", located.p_value);
    located.gap.clone()
}

fn covariates(gap: &[Gap]) -> Vec<&'static str> {
    gap.iter().map(|gap| gap.covariate).collect()
}

#[test]
fn elements_that_differ_at_some_depths_are_seen_as_such() {
    let found = gap(|signal, depth_mm| {
        let of = |(element, signal): (usize, &f64)| match (element % 6, depth_mm > 0.37) {
            (1, true) => 0.15 * signal,
            (4, true) => -0.15 * signal,
            _ => 0.0,
        };
        signal.iter().enumerate().map(of).collect()
    });
    assert!(covariates(&found).contains(&"element and depth"), "{found:?}");
    assert!(!covariates(&found).contains(&"element"), "gains are fitted: {found:?}");
}

#[test]
fn a_supply_that_droops_with_the_sum_of_signals_is_seen_as_such() {
    let found = gap(|signal, _| {
        let sum: f64 = signal.iter().sum();
        signal.iter().map(|signal| -2e-4 * sum * signal).collect()
    });
    assert!(covariates(&found).contains(&"sum of signals"), "{found:?}");
}
