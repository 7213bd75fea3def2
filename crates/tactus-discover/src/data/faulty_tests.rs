use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_model::Effect;

use super::*;
use crate::fixtures::{ELEMENTS, found, known, measured, processes};
use crate::{Discovery, Verdict};

fn cross_wired(pairs: &[[usize; 2]]) -> Vec<FaultyElement> {
    let of = |[element, answers_for]: [usize; 2]| FaultyElement {
        element,
        kind: FaultKind::CrossWired { answers_for },
        evidence: String::new(),
    };
    pairs.iter().copied().map(of).collect()
}

fn miswired(element: usize, answers_for: usize, other_share: f64) -> Effect {
    let parameters = [
        ("element", element as f64),
        ("answers_for", answers_for as f64),
        ("own_share", 0.0),
        ("other_share", other_share),
    ];
    Effect::new(MISWIRED, parameters).unwrap()
}

/// White noise of 2 counts rms.
fn noise(seed: u64) -> Vec<Vec<f64>> {
    processes(ELEMENTS, 2.0, 1e-3, &mut ChaCha8Rng::seed_from_u64(seed))
}

/// Elements of the terms of `miswired`, ascending.
fn rewired(found: &Discovery) -> Vec<f64> {
    let steps = found.steps.iter().filter(|step| step.effect == MISWIRED);
    let mut elements: Vec<f64> = steps.flat_map(|step| step.terms.iter().map(|term| term[0].value)).collect();
    elements.sort_by(f64::total_cmp);
    elements
}

#[test]
fn two_elements_that_answer_for_the_next_are_the_papers_and_three_are_a_shift() {
    let known = known();
    let paper = Faulty::judged(&known, cross_wired(&[[18, 19], [22, 23]])).unwrap();
    assert_eq!((paper.elements.len(), paper.effects.len(), paper.warning), (2, 2, None));
    let shifted = Faulty::judged(&known, cross_wired(&[[18, 19], [22, 23], [9, 10]])).unwrap();
    assert_eq!((shifted.elements.len(), shifted.effects.len()), (0, 0));
    assert!(shifted.warning.unwrap().contains("3 elements"));
    let apart = Faulty::judged(&known, cross_wired(&[[18, 19], [22, 23], [9, 1]])).unwrap();
    assert_eq!((apart.effects.len(), apart.warning), (3, None));
}

#[test]
fn more_than_a_tenth_cannot_be_cross_wired() {
    let pairs = [[0, 1], [5, 4], [9, 17], [20, 12], [30, 47]];
    let few = Faulty::judged(&known(), cross_wired(&pairs[..4])).unwrap();
    assert_eq!((few.effects.len(), few.warning), (4, None));
    let many = Faulty::judged(&known(), cross_wired(&pairs)).unwrap();
    assert_eq!((many.effects.len(), many.elements.len(), many.warning.is_some()), (0, 0, true));
}

#[test]
fn a_sensor_that_lies_a_pitch_aside_has_no_cross_wired_element() {
    let frames = measured(&known(), &[], &noise(8));
    let mut aside = known();
    aside.registration.origin_mm = [2.0, 0.0];
    let noise = Noise::of_differences(&frames, aside.array.step_counts());
    let faulty = Faulty::of(&aside, &frames, &noise).unwrap();
    assert_eq!((faulty.elements.len(), faulty.effects.len()), (0, 0), "{:?}", faulty.elements);
}

#[test]
fn an_element_that_the_model_rewires_is_not_rewired_again() {
    let known = Known { effects: vec![miswired(18, 19, 1.0), miswired(5, 5, 0.0)], ..known() };
    let dead = |element| FaultyElement { element, kind: FaultKind::Dead, evidence: String::new() };
    let mut faults = cross_wired(&[[18, 19], [22, 23]]);
    faults.extend([dead(5), dead(6)]);
    let faulty = Faulty::judged(&known, faults).unwrap();
    let of =
        |effect: &Effect| super::rewired(effect.definition(), effect.parameters().map(|(_, value)| value));
    let elements: Vec<Option<usize>> = faulty.effects.iter().map(of).collect();
    assert_eq!(elements, [Some(22), Some(6)]);
    assert_eq!((faulty.elements.len(), faulty.silent), (4, vec![5, 6]));
}

#[test]
fn a_model_that_has_the_fault_is_missing_nothing() {
    let effects = vec![miswired(5, 5, 0.0), miswired(18, 19, 1.0)];
    let frames = measured(&known(), &effects, &noise(3));
    let found = found(&Known { effects: effects.clone(), ..known() }, &frames);
    assert_eq!((found.verdict, found.steps.len(), found.faulty.len()), (Verdict::NothingMissing, 0, 2));
    assert_eq!(found.effects.len(), 2, "{:?}", found.effects);
}

/// Of the elements that are stuck or noisy nothing is learned, and nothing of the others is lost.
#[test]
fn stuck_and_noisy_elements_change_no_other_result() {
    let known = known();
    let growth = [("growth_at_1_mm", 0.15), ("exponent", 1.0), ("own_share", 1.0)];
    let hardening = Effect::new("hardening", growth).unwrap();
    let sound = noise(4);
    let mut faulty = sound.clone();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    // Far above the others, and with a memory of seconds.
    let bursts = processes(1, 60.0, 3.0, &mut rng);
    for (faulty, burst) in faulty.iter_mut().zip(bursts) {
        faulty[30] += burst[0];
        faulty[12] = f64::NAN;
    }
    let mut frames = measured(&known, std::slice::from_ref(&hardening), &faulty);
    frames.counts.iter_mut().filter(|counts| counts.is_nan()).for_each(|counts| *counts = 812.0);
    let with = found(&known, &frames);
    let without = found(&known, &measured(&known, &[hardening], &sound));
    let kinds: Vec<(usize, FaultKind)> = with.faulty.iter().map(|one| (one.element, one.kind)).collect();
    assert!(
        matches!(kinds[..], [(12, FaultKind::Stuck { counts: 812.0 }), (30, FaultKind::Noisy { .. })]),
        "{kinds:?}"
    );
    let names = |found: &Discovery| found.steps.iter().map(|step| step.effect).collect::<Vec<_>>();
    assert_eq!((names(&with), rewired(&with)), (vec![MISWIRED, "hardening"], vec![12.0]));
    assert_eq!(names(&without), ["hardening"]);
    assert_eq!((with.verdict, without.verdict), (Verdict::Explained, Verdict::Explained));
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 0.03;
    for [with, without] in [
        [with.base.heldout_rms_counts, without.base.heldout_rms_counts],
        [with.final_.level.heldout_rms_counts, without.final_.level.heldout_rms_counts],
        [with.steps[1].terms[0][0].value, without.steps[0].terms[0][0].value],
    ] {
        assert!(close(with, without), "{with} {without}");
    }
    assert!([12, 30].iter().all(|element| with.elements[*element].after_rms_counts.is_nan()));
    // The grown model reads the stuck element's constant, whatever is pressed.
    assert!((with.grown.response.baseline_counts[12] - 812.0).abs() < 1e-6);
}

/// After a press an element takes half a second to come to rest, as behind a slow filter.
#[test]
fn the_decay_after_presses_is_no_noise() {
    let known = known();
    let mut upon = noise(7);
    for press in (0..ELEMENTS).filter(|press| press % 2 == 0) {
        for frame in 25..30 {
            let since_s = 0.1 * f64::from(u8::try_from(frame - 24).unwrap());
            upon[30 * press + frame][20] += 60.0 * (-since_s / 0.3).exp();
        }
    }
    let frames = measured(&known, &[], &upon);
    let mut readings = ReadingsBuilder::new(&known.array);
    frames.rows().for_each(|row| readings.take(row));
    let readings = readings.finish();
    assert!(readings.noise_rms_counts[20].unwrap() > 6.0, "{:?}", readings.noise_rms_counts[20]);
    let noise = Noise::of_differences(&frames, known.array.step_counts());
    assert_eq!(Faulty::of(&known, &frames, &noise).unwrap().elements, []);
}

#[test]
fn a_dead_and_a_cross_wired_element_are_found_beside_hardening() {
    let known = known();
    let growth = [("growth_at_1_mm", 0.15), ("exponent", 1.0), ("own_share", 1.0)];
    let hardening = Effect::new("hardening", growth).unwrap();
    let hidden = [miswired(5, 5, 0.0), miswired(22, 23, 1.0), hardening];
    let found = found(&known, &measured(&known, &hidden, &noise(6)));
    let mut names: Vec<&str> = found.steps.iter().map(|step| step.effect).collect();
    names.sort_unstable();
    assert_eq!((names, rewired(&found)), (vec!["hardening", MISWIRED], vec![5.0, 22.0]));
    assert_eq!(found.verdict, Verdict::Explained);
    let step = found.steps.iter().find(|step| step.effect == MISWIRED).unwrap();
    assert!(
        step.p_value < 0.005 && step.heldout_rms_before_counts > step.heldout_rms_after_counts,
        "{step:?}"
    );
    let dead =
        found.effects.iter().find(|one| one.name() == MISWIRED && one.value("element") == Some(5.0)).unwrap();
    assert_eq!((dead.value("own_share"), dead.value("other_share")), (Some(0.0), Some(0.0)));
}
