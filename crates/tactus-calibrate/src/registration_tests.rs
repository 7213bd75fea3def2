use super::*;
use crate::{readings::Readings, synthetic_sensor::SyntheticSensor, synthetic_sensor::THIN_MM};

fn registered(declared: &Declared, readings: &Readings) -> RegistrationFit {
    register(declared, readings, &vec![true; readings.elements]).unwrap().0
}

/// Distance of an estimate from the truth, in standard errors.
fn off(estimate: Estimate, truth: f64) -> f64 {
    ((estimate.value - truth) / estimate.standard_error).abs()
}

#[test]
fn place_and_surface_come_back_within_their_errors() {
    let mut sensor = SyntheticSensor::new(1);
    sensor.centres();
    let (truth, surface_mm) = (sensor.registration, sensor.surface_mm);
    let (declared, readings) = sensor.readings();
    let found = registered(&declared, &readings);
    let errors = [
        off(found.origin_mm[0], truth.origin_mm[0]),
        off(found.origin_mm[1], truth.origin_mm[1]),
        off(found.rotation_deg.unwrap(), truth.rotation_deg),
        off(found.surface_mm.unwrap(), surface_mm),
        off(found.scale.unwrap(), 1.0),
    ];
    assert!(errors.iter().all(|error| *error < 4.0), "{errors:?} {found:?}");
    assert!(found.origin_mm[0].standard_error < 0.002, "{found:?}");
    assert!((found.residual_in_noise - 1.0).abs() < 0.05, "{}", found.residual_in_noise);
}

#[test]
fn a_stage_whose_steps_are_wrong_shows_in_the_scale() {
    let mut sensor = SyntheticSensor::new(2);
    for element in 0..48 {
        // The stage goes 1 % too far from the middle of its travel.
        let place_mm = sensor.centre_mm(element).map(|along| 25.0 + (along - 25.0) * 0.99);
        sensor.press(place_mm, THIN_MM, &[0.2, 0.4, 0.6]);
    }
    let (declared, readings) = sensor.readings();
    // Near the sensor the stage's positions are right, so the fitted pose is not wrong.
    let scale = registered(&declared, &readings).scale.unwrap();
    assert!(scale.covers(1.0), "{scale:?}");

    let mut wrong = declared.clone();
    let array = declared.array();
    let stretched = |centres: &[f64]| centres.iter().map(|centre| centre * 1.01).collect();
    let longer = tactus_model::Array::new(
        "longer",
        array.element_mm(),
        stretched(array.col_centres_mm()),
        stretched(array.row_centres_mm()),
        30.0,
        4095.0,
        1.0,
    );
    wrong.model =
        ForwardModel::new(longer.unwrap(), declared.model.psf(), declared.model.response().clone()).unwrap();
    let scale = registered(&wrong, &readings).scale.unwrap();
    assert!((scale.value - 1.0 / 1.01).abs() < 5e-4 && !scale.covers(1.0), "{scale:?}");
}

#[test]
fn a_press_that_contradicts_the_others_is_left_out_and_named() {
    let mut sensor = SyntheticSensor::new(3);
    sensor.spoil = Box::new(|counts, press| {
        if press == 17 {
            counts.iter_mut().rev().for_each(|count| *count = 100.0 + (*count - 100.0) * 0.3);
        }
    });
    sensor.centres();
    let truth = sensor.registration;
    let (declared, readings) = sensor.readings();
    let found = registered(&declared, &readings);
    assert_eq!(found.left_out, [("run".to_owned(), 17)]);
    assert!(off(found.origin_mm[0], truth.origin_mm[0]) < 4.0);
}

#[test]
fn presses_close_together_tell_no_rotation() {
    let mut sensor = SyntheticSensor::new(4);
    sensor.sweep(THIN_MM, 4);
    let (declared, readings) = sensor.readings();
    let found = registered(&declared, &readings);
    assert_eq!((found.rotation_deg, found.scale), (None, None));
}

#[test]
fn one_place_tells_nothing() {
    let mut sensor = SyntheticSensor::new(5);
    let place_mm = sensor.centre_mm(20);
    sensor.press(place_mm, THIN_MM, &[0.2, 0.4]);
    let (declared, readings) = sensor.readings();
    let refused = register(&declared, &readings, &[true; 48]).unwrap_err();
    assert!(refused.contains("1 place was"), "{refused}");
}
