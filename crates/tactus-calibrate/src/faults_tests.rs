use std::cell::RefCell;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::{readings::Readings, synthetic_sensor::SyntheticSensor, synthetic_sensor::THIN_MM};

fn health(declared: &Declared, readings: &Readings) -> Health {
    let place = SensorPose::declared(declared, THIN_MM);
    examine(declared, readings, &place)
}

#[test]
fn a_sound_sensor_is_accused_of_nothing() {
    let mut sensor = SyntheticSensor::new(1);
    sensor.centres();
    let (declared, readings) = sensor.readings();
    assert_eq!(health(&declared, &readings), Health { faults: Vec::new(), not_judged: Vec::new() });
}

#[test]
fn each_kind_of_fault_is_found_and_named() {
    let mut sensor = SyntheticSensor::new(2);
    sensor.spoil = Box::new(|counts, _| {
        counts[5] = 100.0;
        counts[18] = counts[19];
        // A noise that the made-up sensor does not draw: it alternates.
        counts[30] += if (counts[30] * 1e6).to_bits() & 1 == 0 { 30.0 } else { -30.0 };
    });
    sensor.centres();
    let (declared, mut readings) = sensor.readings();
    readings.constant_counts[40] = Some(812.0);
    readings.noise_rms_counts[40] = Some(12.0_f64.sqrt().recip());
    readings.noise_rms_counts[30] = Some(30.0);
    let kinds: Vec<(usize, FaultKind)> =
        health(&declared, &readings).faults.into_iter().map(|fault| (fault.element, fault.kind)).collect();
    assert_eq!(
        kinds,
        [
            (5, FaultKind::Dead),
            (18, FaultKind::CrossWired { answers_for: 19 }),
            (30, FaultKind::Noisy { rms_counts: 30.0 }),
            (40, FaultKind::Stuck { counts: 812.0 }),
        ]
    );
}

#[test]
fn elements_that_nobody_pressed_are_not_judged() {
    let mut sensor = SyntheticSensor::new(3);
    for element in [9, 10, 17, 18, 19] {
        sensor.press(sensor.centre_mm(element), THIN_MM, &[0.3]);
    }
    let (declared, readings) = sensor.readings();
    let health = health(&declared, &readings);
    assert!(health.faults.is_empty(), "{health:?}");
    assert!(health.not_judged.contains(&47) && !health.not_judged.contains(&10), "{:?}", health.not_judged);
}

#[test]
fn elements_that_fall_when_pressed_are_sound() {
    let mut sensor = SyntheticSensor::new(4);
    sensor.spoil = Box::new(|counts, _| counts.iter_mut().for_each(|count| *count = 3000.0 - *count));
    sensor.centres();
    let (declared, readings) = sensor.readings();
    assert!(health(&declared, &readings).faults.is_empty());
}

#[test]
fn many_dead_elements_do_not_pass_for_the_rule() {
    let mut sensor = SyntheticSensor::new(5);
    sensor.spoil = Box::new(|counts, _| counts[..30].fill(100.0));
    sensor.centres();
    let (declared, readings) = sensor.readings();
    let dead: Vec<usize> = health(&declared, &readings).faults.iter().map(|fault| fault.element).collect();
    assert_eq!(dead, (0..30).collect::<Vec<_>>());
}

/// Adds first-order autoregressive noise of 2.4 counts rms with a correlation of .8 from frame to frame.
fn remembering(seed: u64, elements: usize) -> impl Fn(&mut [f64]) {
    let state = RefCell::new((ChaCha8Rng::seed_from_u64(seed), vec![0.0; elements]));
    move |counts| {
        let (rng, noise) = &mut *state.borrow_mut();
        for (count, noise) in counts.iter_mut().zip(noise) {
            let deviate: f64 = StandardNormal.sample(rng);
            *noise = 0.8 * *noise + 2.4 * 0.6 * deviate;
            *count += *noise;
        }
    }
}

#[test]
fn the_greatest_of_many_presses_in_noise_that_remembers_hides_no_dead_element() {
    for seed in 8..12 {
        let mut sensor = SyntheticSensor::new(seed);
        sensor.noise_counts = 0.0;
        let noise = remembering(seed, 48);
        sensor.spoil = Box::new(move |counts, _| {
            (counts[5], counts[39]) = (100.0, 100.0);
            noise(counts);
        });
        sensor.centres();
        sensor.sweep(THIN_MM, 15);
        let (declared, readings) = sensor.readings();
        assert!(readings.presses.len() > 700);
        let faults = health(&declared, &readings).faults;
        let kinds: Vec<(usize, FaultKind)> = faults.iter().map(|fault| (fault.element, fault.kind)).collect();
        assert_eq!(kinds, [(5, FaultKind::Dead), (39, FaultKind::Dead)], "{faults:?}");
    }
}

#[test]
fn a_weak_element_is_not_dead() {
    let mut sensor = SyntheticSensor::new(12);
    sensor.spoil = Box::new(|counts, _| counts[10] = 100.0 + 0.3 * (counts[10] - 100.0));
    sensor.centres();
    let (declared, readings) = sensor.readings();
    assert_eq!(health(&declared, &readings).faults, []);
}

#[test]
fn a_sensor_half_a_pitch_aside_has_no_faulty_element() {
    for [x_mm, y_mm] in [[1.0, 0.0], [0.0, -1.0], [-1.0, 1.0]] {
        let mut sensor = SyntheticSensor::new(13);
        let origin_mm = &mut sensor.registration.origin_mm;
        (origin_mm[0], origin_mm[1]) = (20.0 + x_mm, 15.0 + y_mm);
        sensor.centres();
        let (declared, readings) = sensor.readings();
        assert_eq!(health(&declared, &readings).faults, [], "at the declared place, {x_mm} {y_mm}");
        assert_eq!(crate::health(&declared, &readings).unwrap().faults, [], "{x_mm} {y_mm}");
    }
}

#[test]
fn an_element_that_gives_a_distant_ones_signal_is_not_dead() {
    let mut sensor = SyntheticSensor::new(14);
    sensor.spoil = Box::new(|counts, _| counts[1] = counts[46]);
    sensor.centres();
    let (declared, readings) = sensor.readings();
    let faults = health(&declared, &readings).faults;
    let kinds: Vec<(usize, FaultKind)> = faults.iter().map(|fault| (fault.element, fault.kind)).collect();
    assert_eq!(kinds, [(1, FaultKind::CrossWired { answers_for: 46 })]);
}

#[test]
fn presses_too_light_to_be_felt_judge_no_element() {
    let mut sensor = SyntheticSensor::new(15);
    sensor.spoil =
        Box::new(|counts, _| counts.iter_mut().for_each(|count| *count = 100.0 + 1e-3 * (*count - 100.0)));
    sensor.centres();
    let (declared, readings) = sensor.readings();
    let health = health(&declared, &readings);
    assert_eq!((health.faults.len(), health.not_judged.len()), (0, 48));
}

#[test]
fn many_stuck_elements_do_not_make_the_others_noisy() {
    let mut sensor = SyntheticSensor::new(6);
    sensor.centres();
    let (declared, mut readings) = sensor.readings();
    for element in 0..30 {
        readings.constant_counts[element] = Some(500.0);
        readings.noise_rms_counts[element] = Some(12.0_f64.sqrt().recip());
    }
    let faults = health(&declared, &readings).faults;
    assert_eq!(faults.len(), 30);
    assert!(faults.iter().all(|fault| matches!(fault.kind, FaultKind::Stuck { .. })), "{faults:?}");
}

#[test]
fn a_sensor_that_answers_to_nothing_is_not_judged() {
    let mut sensor = SyntheticSensor::new(7);
    sensor.spoil = Box::new(|counts, _| counts.fill(100.0));
    sensor.centres();
    let (declared, readings) = sensor.readings();
    let health = health(&declared, &readings);
    assert_eq!((health.faults.len(), health.not_judged.len()), (0, 48));
}
