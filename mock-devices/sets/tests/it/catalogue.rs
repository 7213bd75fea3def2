//! Every physics of the catalogue, on a short bundle.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use tactus_hidden::{CATALOGUE, Climate, Dose, HiddenSensor, RandomRig};
use tactus_sets::{Plan, Separation};

/// Counts of a short bundle without noise, with one physics or none.
fn counts(base: &RandomRig, dose: Option<Dose>) -> Vec<f64> {
    let array = &base.rig.array;
    let run =
        Plan::Bundle.runs(array, base.rig.registration, base.rig.covering, Some(900), 1).unwrap().remove(0);
    let mut sensor = HiddenSensor::new(&base.sensor, dose.as_slice(), Climate::new(1), 0);
    let mut all = Vec::new();
    for frame in 0..run.frames {
        sensor.step(frame as f64 / array.rate_hz(), &run.trajectory);
        all.extend(sensor.counts().iter().map(|count| sensor.convert(*count)));
    }
    all
}

#[test]
fn every_physics_is_the_base_model_at_no_strength_and_differs_at_full_strength() {
    let base = RandomRig::new(11).unwrap();
    let clean = counts(&base, None);
    for physics in CATALOGUE {
        let at = |strength, seed| counts(&base, Some(Dose { physics, strength, seed }));
        for seed in [1, 2] {
            let off = clean.iter().zip(at(0.0, seed)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-9, "{} at no strength: {off} counts off", physics.id);
        }
        let with = at(1.0, 1);
        assert!(with.iter().all(|count| count.is_finite()), "{}", physics.id);
        let z = Separation::new(&clean, &with, &clean, 48, 1.0).z;
        assert!(z > 3.0, "{}: {z}", physics.id);
    }
}
