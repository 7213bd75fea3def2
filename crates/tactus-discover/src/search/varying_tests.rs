use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Effect;
use tactus_model::effect::Definition;

use super::varying_effect;
use crate::fixtures::{ELEMENTS, INTERVAL_S, found, known, measured, processes};

/// A sensor that sinks on one side in 40 s is a tilt that grows. What a constant tilt misses of it is no further effect.
#[test]
fn what_an_effect_that_varies_misses_gets_no_name_of_its_own() {
    let known = known();
    let noise = processes(ELEMENTS, 1.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(11));
    let silent = vec![vec![0.0; ELEMENTS]; noise.len()];
    let flat = Effect::neutral(Definition::find("surface-tilt").unwrap());
    let tilt = flat.with("slope_x_mm_per_mm", 0.001).unwrap();
    let [without, with] = [&[][..], &[tilt]].map(|effects| measured(&known, effects, &silent));
    let settled = |(frame, noise): (usize, &Vec<f64>)| -> Vec<f64> {
        let share = 1.0 - (-(frame as f64) * INTERVAL_S / 40.0).exp();
        let change = with.counts_of(frame).iter().zip(without.counts_of(frame));
        change.zip(noise).map(|((with, without), noise)| noise + share * f64::from(with - without)).collect()
    };
    let frames = measured(&known, &[], &noise.iter().enumerate().map(settled).collect::<Vec<_>>());
    let discovery = found(&known, &frames);
    let names: Vec<&str> = discovery.steps.iter().map(|step| step.effect).collect();
    assert_eq!(names, ["surface-tilt"], "{:#?}", discovery.contests);
    let lost = discovery.contests.iter().filter(|contest| !contest.kept);
    let mut against = lost.flat_map(|contest| &contest.rivals);
    assert!(against.any(|rivalry| rivalry.rival == "surface-tilt that varies with time"));
}

#[test]
fn a_rival_tells_the_effect_that_varies() {
    assert_eq!(varying_effect("gain-drift that varies with depth"), Some("gain-drift"));
    assert_eq!(["tone in x", "gain-drift"].map(varying_effect), [None, None]);
}
