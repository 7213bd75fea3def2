use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::Array;

use super::Kind;
use crate::fit::Prepared;
use crate::fixtures::{self, ELEMENTS, INTERVAL_S, known, measured};
use crate::progress::Reporter;
use crate::search::Candidate;
use crate::{Frames, Known};

/// Another sensor of the same physics: its counts are `unit` times as many, from a zero that is moved by this share of its baseline.
fn otherwise(known: &Known, frames: &Frames, unit: f64, zero_share: f64) -> (Known, Frames) {
    let mut response = known.response.clone();
    let zero_counts = zero_share * response.baseline_counts[0];
    response.sensitivity_counts_per_mm.iter_mut().for_each(|gain| *gain *= unit);
    response.baseline_counts.iter_mut().for_each(|zero| *zero = unit * (*zero + zero_counts));
    let of = &known.array;
    let array = Array::new(
        of.name(),
        of.element_mm(),
        of.col_centres_mm().to_vec(),
        of.row_centres_mm().to_vec(),
        of.rate_hz(),
        of.full_scale_counts() * unit.abs(),
        of.step_counts() * unit.abs(),
    );
    let known = Known { response, array: array.unwrap(), ..known.clone() };
    let mut frames = frames.clone();
    #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
    frames.counts.iter_mut().for_each(|counts| *counts = (unit * (f64::from(*counts) + zero_counts)) as f32);
    (known, frames)
}

/// The odds of everything that may be added to the base model of these data, with its name.
fn odds(known: &Known, frames: &Frames) -> Vec<(String, f64)> {
    let prepared = Prepared::new(known, frames, 1).unwrap();
    let problem = prepared.problem();
    let candidates = Candidate::all(&problem, &prepared.base, &prepared.lines).unwrap();
    let reporter = Reporter::new(&|_| {});
    let search = fixtures::search(&problem, &candidates, &reporter);
    let pass = search.pass(&prepared.base).unwrap();
    let evidence = pass.evidence_on(pass.grams.reduced());
    let of = |one: usize| {
        let kind = match &pass.kinds[one] {
            Kind::Term { shape, .. } => format!("{:?}", shape.values),
            Kind::Rival => "rival".to_owned(),
            Kind::Free(class) => format!("of {class}"),
        };
        (format!("{} {kind}", pass.class_of(one)), evidence.gain_alone(one).ln_likelihood)
    };
    (0..pass.additions.len()).map(of).collect()
}

/// A tone and a drift in counts, and noise, on the paper's sensor.
fn with_a_tone_and_a_drift(known: &Known) -> Frames {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let upon = (0..30 * ELEMENTS).map(|frame| {
        let t_s = frame as f64 * INTERVAL_S;
        let of_all = (TAU * 1.37 * t_s).sin() + 4.0 * (-t_s / 60.0).exp();
        (0..ELEMENTS).map(|_| of_all + normal()).collect()
    });
    measured(known, &[], &upon.collect::<Vec<_>>())
}

#[test]
fn odds_depend_neither_on_the_unit_of_counts_nor_on_their_zero() {
    let known = known();
    let frames = with_a_tone_and_a_drift(&known);
    let expected = odds(&known, &frames);
    for (unit, zero_share) in
        [(1e-4, 0.0), (1.0 / 4095.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, -1.0), (-1.0, 0.0), (-1e-3, -1.0)]
    {
        let (known, frames) = otherwise(&known, &frames, unit, zero_share);
        let found = odds(&known, &frames);
        assert_eq!(found.len(), expected.len());
        for ((name, odds), (expected_name, expected)) in found.iter().zip(&expected) {
            let is_alike = (odds - expected).abs() <= 0.01 * expected.abs() + 0.05;
            assert!(is_alike, "unit {unit}, zero {zero_share}: {name} {odds}, {expected_name} {expected}");
        }
    }
}
