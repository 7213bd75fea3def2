use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::effect::When;

use super::*;
use crate::fit::Prepared;
use crate::fixtures::{ELEMENTS, OPTIONS, known, measured, processes, search};
use crate::progress::Reporter;

/// By how much counts in contact, with a weight for each element, are nearer to unseen presses, where all elements read so many counts more in
/// contact, under noise of 1 count.
fn unseen_gain(more: f64) -> f64 {
    let known = known();
    let at_rest = measured(&known, &[], &vec![vec![0.0; ELEMENTS]; 30 * ELEMENTS]);
    let mut upon = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(7));
    for (upon, position_mm) in upon.iter_mut().zip(&at_rest.position_mm) {
        let more = if position_mm[2] < 0.0 { more } else { 0.0 };
        for upon in upon {
            *upon += more;
        }
    }
    let frames = measured(&known, &[], &upon);
    let prepared = Prepared::new(&known, &frames, OPTIONS.seed).unwrap();
    let (problem, base) = (prepared.problem(), &prepared.base);
    let reporter = Reporter::new(&|_| {});
    let search = search(&problem, &[], &reporter);
    let sight = Arc::new(Sight::of(&problem, base).unwrap());
    let is_constant = |atom: &Atom| {
        let acts_so = (atom.carrier, atom.when) == (Carrier::Counts, When::InContact);
        acts_so && atom.of_elements && atom.columns(ELEMENTS) == ELEMENTS
    };
    let atom = grammar::atoms(&problem, base, &sight, false).into_iter().find(is_constant).unwrap();
    // Of each element what it reads more in the mean in contact, by all presses.
    let bins = problem.predictor.bins;
    let mut weights = vec![0.0; ELEMENTS];
    for bin in (0..bins.len()).filter(|bin| !bins.is_clear(&frames, *bin)) {
        for (element, weight) in weights.iter_mut().enumerate() {
            let reading = bin * ELEMENTS + element;
            *weight += bins.weight[bin] * (bins.counts[reading] - base.predicted[reading]);
        }
    }
    let atom = Atom { of_elements: false, weights: Some(Arc::new(weights)), ..atom };
    search.unseen_gains_of(base, &sight, &atom).unwrap().iter().sum()
}

#[test]
fn weights_that_were_found_in_noise_gain_nothing_on_unseen_presses() {
    let (in_noise, of_counts) = (unseen_gain(0.0), unseen_gain(1.0));
    assert!(in_noise <= 0.0 && of_counts > 100.0, "{in_noise} {of_counts}");
}
