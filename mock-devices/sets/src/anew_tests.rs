use std::f64::consts::TAU;

use tactus_model::effect::{Carrier, Draft, Law, When};
use tactus_model::{Contact, Covariate};

use super::*;
use crate::{Amount, Content, NoiseKind};

fn short(id: &str) -> Recipe {
    Recipe {
        frames: Some(1500),
        noise: NoiseKind::White,
        content: Content { physics: vec![id.into()], ..Content::default() },
        amount: Amount::Strength(1.0),
        ..Recipe::new(21)
    }
}

#[test]
fn without_physics_new_data_are_the_same_sensor_on_another_path() {
    let recipe = short("range-switch");
    let (set, anew) = (recipe.make().unwrap(), recipe.make_anew(&[]).unwrap());
    assert_eq!((&anew.rig, anew.rows.len(), anew.label.noise), (&set.rig, 1500, set.label.noise));
    assert!(
        anew.rows.iter().zip(&set.rows).any(|(one, other)| one.position_mm[0] - other.position_mm[0] > 1.0)
    );
    let base = recipe.base().unwrap();
    let mut image = vec![0.0; 48];
    let mut squares = 0.0;
    for row in &anew.rows {
        let [x, y, z] = row.position_mm;
        let contact = Contact {
            indenter: base.sensor.indenter.clone(),
            position_mm: set.rig.registration.to_sensor([x, y]),
            rotation_deg: 0.0,
            depth_mm: -z,
        };
        base.sensor.model.image(&contact, set.rig.covering, &mut image);
        squares += row
            .counts
            .iter()
            .zip(&image)
            .map(|(count, clean)| (f64::from(*count) - clean).powi(2))
            .sum::<f64>();
    }
    let rms = (squares / (1500.0 * 48.0)).sqrt();
    let expected = (anew.label.noise.rms_counts.powi(2) + 1.0 / 12.0).sqrt();
    assert!((rms / expected - 1.0).abs() < 0.05, "{rms} for {expected}");
}

/// The tone goes on between two measurements.
#[test]
fn new_data_are_an_hour_later() {
    let recipe = short("contact-hum");
    let hidden = recipe.make().unwrap().label.physics;
    let [with, without] = [&hidden[..], &[]].map(|physics| recipe.make_anew(physics).unwrap());
    let frequency_hz = hidden[0].parameters["frequency_hz"];
    // Tangent of the phase that the tone had at the start, if that was at this time.
    let out_of_phase = |begin_s: f64| {
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (row, clean) in with.rows.iter().zip(&without.rows) {
            let phase = TAU * frequency_hz * (begin_s + row.t_ns as f64 * 1e-9);
            let change: f32 = row.counts.iter().zip(&clean.counts).map(|(with, clean)| with - clean).sum();
            sine += f64::from(change) * phase.sin();
            cosine += f64::from(change) * phase.cos();
        }
        cosine / sine
    };
    assert!(out_of_phase(3600.0).abs() < 0.1, "{}", out_of_phase(3600.0));
    assert!(out_of_phase(0.0).abs() > 0.2, "{}", out_of_phase(0.0));
}

/// A change of counts that depends on counts.
fn of_counts(law: Law) -> Effect {
    let draft = Draft {
        name: "draft-1".into(),
        sentence: "Counts change.".into(),
        carrier: Carrier::Counts,
        when: When::Always,
        covariates: vec![Covariate::Counts],
        ranges: vec![[0.0, 4096.0]],
        law,
        weights: None,
    };
    Effect::neutral(draft.define().unwrap()).with("strength", 1.0).unwrap()
}

#[test]
fn the_error_of_a_curve_is_the_share_that_it_misses() {
    let recipe = short("range-switch");
    let hidden = recipe.make().unwrap().label.physics.remove(0);
    let (step, at) = (hidden.parameters["step_counts"], hidden.parameters["limit_counts"]);
    let error = |law: Law| recipe.relative_error(&of_counts(law), &hidden).unwrap().unwrap();
    let of_share = |share: f64| error(Law::Threshold { scale: share * step, at });
    assert!(of_share(1.0) < 1e-6, "{}", of_share(1.0));
    // Gains act on the counts with the step, or without it: this is not quite linear.
    for share in [0.5, 0.9, 1.2] {
        assert!((of_share(share) - (share - 1.0).abs()).abs() < 0.02, "{share}: {}", of_share(share));
    }
    // Gains and zeros take up all of this: it describes nothing, and is no error.
    let recalibration = error(Law::Linear { offset: 30.0, slope: 0.1 });
    assert!((recalibration - 1.0).abs() < 1e-6, "{recalibration}");
}
