use super::*;
use crate::{registration::register, synthetic_sensor::SyntheticSensor};

fn responded(sensor: SyntheticSensor) -> (ResponseFit, Vec<f64>) {
    let gains = sensor.model.response().sensitivity_counts_per_mm.clone();
    let (declared, readings) = sensor.readings();
    let sound = vec![true; readings.elements];
    let (_, place) = register(&declared, &readings, &sound).unwrap();
    let health = Health { faults: Vec::new(), not_judged: Vec::new() };
    (respond(&declared, &readings, &health, &place).unwrap().0, gains)
}

/// The same sensor with other curvatures.
fn curved(seed: u64, quadratic_per_mm: impl Fn(usize) -> f64) -> SyntheticSensor {
    let mut sensor = SyntheticSensor::new(seed);
    let response = tactus_model::Response {
        quadratic_per_mm: (0..48).map(quadratic_per_mm).collect(),
        ..sensor.model.response().clone()
    };
    sensor.model =
        tactus_model::ForwardModel::new(sensor.model.array().clone(), sensor.model.psf(), response).unwrap();
    sensor.centres();
    sensor
}

#[test]
fn a_straight_response_is_found_straight() {
    let (fit, gains) = responded(curved(1, |_| 0.0));
    assert_eq!(fit.form, ResponseForm::Linear);
    let worst = fit.elements.iter().map(|one| {
        (one.sensitivity_counts_per_mm.value - gains[one.element]).abs()
            / one.sensitivity_counts_per_mm.standard_error
    });
    assert!(worst.fold(0.0, f64::max) < 4.5);
}

#[test]
fn one_curvature_is_found_as_one() {
    let (fit, gains) = responded(curved(2, |_| 0.15));
    assert_eq!(fit.form, ResponseForm::SharedQuadratic);
    let curvature = fit.shared_quadratic_per_mm.unwrap();
    assert!((curvature.value - 0.15).abs() < 4.0 * curvature.standard_error + 1e-3, "{curvature:?}");
    for one in &fit.elements {
        let sensitivity = one.sensitivity_counts_per_mm;
        assert!((sensitivity.value - gains[one.element]).abs() < 4.5 * sensitivity.standard_error, "{one:?}");
        // The inverse response gives the depth that was pressed.
        for [u_mm, rise] in &one.points {
            assert!((one.indentation_mm(*rise).unwrap() - u_mm).abs() < 0.004, "{one:?}");
        }
    }
}

/// A surface that is off moves all sensitivities to one side: the mean carries that error, and the differences do not.
#[test]
fn the_error_that_elements_share_is_told_apart_from_their_own() {
    let (fit, gains) = responded(curved(2, |_| 0.15));
    let mean = fit.mean_sensitivity_counts_per_mm;
    let true_mean = gains.iter().sum::<f64>() / gains.len() as f64;
    assert!((mean.value - true_mean).abs() < 4.0 * mean.standard_error, "{mean:?} {true_mean}");
    let (mut sum, mut inside) = (0.0, 0);
    for one in &fit.elements {
        let (whole, own) = (one.sensitivity_counts_per_mm, one.above_mean_counts_per_mm.unwrap());
        assert!((own.value - (whole.value - mean.value)).abs() < 1e-9);
        assert!(own.standard_error < whole.standard_error, "{one:?}");
        sum += own.value;
        inside += usize::from(own.covers(gains[one.element] - true_mean));
    }
    assert!(sum.abs() < 1e-6 && inside >= 42, "{sum} {inside} of {}", fit.elements.len());
}

#[test]
fn curvatures_that_differ_are_found_to() {
    let (fit, _) = responded(curved(3, |element| if element % 2 == 0 { 0.1 } else { 0.5 }));
    assert_eq!(fit.form, ResponseForm::OwnQuadratic);
    let mean = |odd: usize| {
        let of =
            fit.elements.iter().filter(|one| one.element % 2 == odd).map(|one| one.quadratic_per_mm.value);
        of.sum::<f64>() / 24.0
    };
    assert!((mean(0) - 0.1).abs() < 0.01 && (mean(1) - 0.5).abs() < 0.02, "{} {}", mean(0), mean(1));
}

#[test]
fn what_was_held_out_fares_worse_than_what_was_fitted() {
    let (fit, _) = responded(curved(4, |_| 0.15));
    let heldout: Vec<f64> = fit.trials.iter().map(|trial| trial.heldout_rms_counts.unwrap()).collect();
    assert!(heldout[1] < heldout[0] && heldout[1] < heldout[2], "{heldout:?}");
    assert!(fit.trials.iter().all(|trial| trial.heldout_rms_counts.unwrap() > trial.rms_counts));
}

#[test]
fn a_cross_wired_element_keeps_its_own_sensitivity() {
    let mut sensor = SyntheticSensor::new(5);
    let [own, other] = [18, 19].map(|element| sensor.model.response().sensitivity_counts_per_mm[element]);
    sensor.spoil = Box::new(move |counts, _| counts[18] = 100.0 + (counts[19] - 100.0) * own / other);
    sensor.centres();
    let (declared, readings) = sensor.readings();
    let fit = crate::calibrate(&declared, &readings).unwrap().response.unwrap();
    assert!(fit.elements.iter().all(|one| one.element != 18));
    let [crossed] = fit.cross_wired.as_slice() else { panic!("{:?}", fit.cross_wired) };
    assert_eq!(crossed.element, 18);
    assert!((crossed.sensitivity_counts_per_mm.value / own - 1.0).abs() < 0.01, "{crossed:?} {own}");
}

#[test]
fn a_response_inverted_is_the_root_near_the_line() {
    assert!((inverted(0.5, 0.0).unwrap() - 0.5).abs() < 1e-15);
    assert!((inverted(0.7 + 0.2 * 0.49, 0.2).unwrap() - 0.7).abs() < 1e-12);
    assert!((inverted(0.7 - 0.2 * 0.49, -0.2).unwrap() - 0.7).abs() < 1e-12);
    // A response with a maximum never reads that much.
    assert_eq!(inverted(3.0, -0.2), None);
}

#[test]
fn a_press_that_was_cut_off_does_not_make_the_response_straight() {
    let mut sensor = SyntheticSensor::new(6);
    sensor.centres();
    let (declared, mut readings) = sensor.readings();
    readings.presses[20].dwells.truncate(2);
    let fit = crate::calibrate(&declared, &readings).unwrap().response.unwrap();
    assert_eq!(fit.form, ResponseForm::SharedQuadratic);
    assert!(fit.trials.iter().all(|trial| trial.heldout_rms_counts.is_some()));
}

#[test]
fn two_depths_give_a_curvature_with_its_error_and_no_surface() {
    let mut sensor = SyntheticSensor::new(7);
    sensor.surface_mm = 0.0;
    for element in 0..48 {
        sensor.press(sensor.centre_mm(element), crate::synthetic_sensor::THIN_MM, &[0.2, 0.5]);
    }
    let gains = sensor.model.response().sensitivity_counts_per_mm.clone();
    let (declared, readings) = sensor.readings();
    let found = crate::calibrate(&declared, &readings).unwrap();
    assert!(found.registration.unwrap().surface_mm.is_none());
    let fit = found.response.unwrap();
    assert_eq!(fit.form, ResponseForm::SharedQuadratic);
    for one in &fit.elements {
        let sensitivity = one.sensitivity_counts_per_mm;
        assert!((sensitivity.value - gains[one.element]).abs() < 4.5 * sensitivity.standard_error, "{one:?}");
    }
}

#[test]
fn elements_that_were_not_fitted_are_not_known_exactly() {
    let mut sensor = SyntheticSensor::new(8);
    for element in [9, 10, 17, 18, 19] {
        sensor.press(sensor.centre_mm(element), crate::synthetic_sensor::THIN_MM, &[0.2, 0.3, 0.4, 0.5, 0.6]);
    }
    let (declared, readings) = sensor.readings();
    let found = crate::calibrate(&declared, &readings).unwrap();
    let (response, [errors, ..]) = found.responses(declared.model.response()).unwrap();
    assert!(errors[47] > 20.0 && errors[47] > 5.0 * errors[18], "{} {}", errors[47], errors[18]);
    assert!((response.sensitivity_counts_per_mm[47] - 1000.0).abs() < 3.0 * errors[47]);
}
