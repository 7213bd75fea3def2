use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::Covariate;
use tactus_model::effect::Carrier;

use super::{hats, rivals};
use crate::Because;
use crate::fit::Prepared;
use crate::fixtures::{ELEMENTS, found, known, measured};

#[test]
fn hats_add_up_to_one_and_interpolate() {
    let values: Vec<f64> = (0..101).map(|k| f64::from(k) / 10.0).collect();
    let among = vec![true; 101];
    let hats = hats(&values, &among);
    let knots: Vec<f64> =
        hats.iter().map(|hat| values[hat.iter().position(|one| *one >= 1.0 - 1e-12).unwrap()]).collect();
    for (bin, value) in values.iter().enumerate() {
        let sum: f64 = hats.iter().map(|hat| hat[bin]).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{value}: {sum}");
        // A straight line is exact.
        let line: f64 = hats.iter().zip(&knots).map(|(hat, knot)| hat[bin] * knot).sum();
        assert!((line - value).abs() < 1e-12, "{value}: {line}");
    }
}

#[test]
fn values_that_do_not_differ_and_bins_that_do_not_count_have_no_part() {
    assert!(hats(&[2.0; 9], &[true; 9]).is_empty());
    let hats = hats(&[1.0, 2.0, 3.0, f64::NAN, 5.0], &[true, true, true, true, false]);
    assert!(hats.iter().all(|hat| hat[3..] == [0.0, 0.0]));
}

/// The rounding of a converter with steps of 8 counts is a tone in counts. Once the steps are seen it is no rival of a name.
#[test]
fn the_tone_of_a_coarse_converter_is_no_rival() {
    const STEP_COUNTS: f64 = 8.0;
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let known = known();
    let silent = vec![vec![0.0; ELEMENTS]; 30 * ELEMENTS];
    let clean = measured(&known, &[], &silent);
    let rounding = (0..30 * ELEMENTS).map(|frame| {
        let of = |counts: &f32| -> f64 {
            let normal: f64 = StandardNormal.sample(&mut rng);
            let counts = f64::from(*counts);
            ((counts + normal) / STEP_COUNTS).round() * STEP_COUNTS - counts
        };
        clean.counts_of(frame).iter().map(of).collect()
    });
    let frames = measured(&known, &[], &rounding.collect::<Vec<_>>());
    let prepared = Prepared::new(&known, &frames, 1).unwrap();
    assert!(prepared.rounds(), "the steps are seen");
    let problem = prepared.problem();
    let has_tone = |rounds: bool| {
        let rivals = rivals(&problem, &prepared.base, 0, rounds).unwrap();
        rivals.iter().any(|rival| rival.name == "tone in counts")
    };
    assert!(has_tone(false) && !has_tone(true));
}

/// An amplifier changes its range at 250 counts, and the two ranges do not meet. Knots of a covering that hardens follow that.
#[test]
fn a_jump_in_counts_is_no_hardening() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let known = known();
    let clean = measured(&known, &[], &vec![vec![0.0; ELEMENTS]; 30 * ELEMENTS]);
    let upon = (0..30 * ELEMENTS).map(|frame| {
        let of = |counts: &f32| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            normal + if *counts > 250.0 { 6.0 } else { 0.0 }
        };
        clean.counts_of(frame).iter().map(of).collect()
    });
    let frames = measured(&known, &[], &upon.collect::<Vec<_>>());
    let found = found(&known, &frames);
    let names: Vec<&str> = found.steps.iter().map(|step| step.effect).collect();
    assert!(names.is_empty(), "{names:?}");
    let given_up: Vec<_> = found.given_up.iter().map(|one| (one.effect, &one.because)).collect();
    assert_eq!(given_up, [("hardening", &Because::Rival("jump in counts"))]);
    let draft = &found.draft.as_ref().unwrap().as_ref().unwrap().draft;
    assert_eq!((draft.carrier, &*draft.covariates), (Carrier::Counts, &[Covariate::Counts][..]));
    // By the counts of the base model, of which gains have taken up a part of the jump.
    let [below, above] = [240.0, 260.0].map(|counts| draft.law.value(&[counts]));
    assert!(below.abs() < 0.5 && (above - 6.0).abs() < 0.5, "{below} {above}: {}", draft.sentence);
}
