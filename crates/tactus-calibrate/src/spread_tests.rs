use crate::{Calibration, calibrate, synthetic_sensor::SyntheticSensor};

const COVERINGS_MM: [f64; 4] = [1.016, 2.54, 3.556, 5.08];

fn whole(seed: u64, spoil: impl Fn(&mut [f64], i32) + 'static) -> Calibration {
    let mut sensor = SyntheticSensor::new(seed);
    sensor.spoil = Box::new(spoil);
    sensor.centres();
    for covering_mm in COVERINGS_MM {
        sensor.next_run();
        sensor.sweep(covering_mm, 5);
    }
    let (declared, readings) = sensor.readings();
    calibrate(&declared, &readings).unwrap()
}

#[test]
fn spreads_and_their_line_come_back_within_their_errors() {
    let found = whole(1, |_, _| ());
    assert_eq!(found.spreads.len(), 12);
    for spread in &found.spreads {
        let truth = 2.22 + 0.497 * spread.covering_mm;
        let off = (spread.sigma_mm.value - truth) / spread.sigma_mm.standard_error;
        assert!(off.abs() < 4.0 && spread.sigma_mm.standard_error < 0.02, "{spread:?}");
    }
    let thickness = found.thickness.unwrap();
    let [intercept, slope] = thickness.linear.unwrap().coefficients;
    assert!((intercept.value - 2.22).abs() < 4.0 * intercept.standard_error, "{intercept:?}");
    assert!((slope.value - 0.497).abs() < 4.0 * slope.standard_error, "{slope:?}");
    let [_, _, bend] = thickness.quadratic.unwrap().coefficients;
    assert!(bend.value.abs() < 4.0 * bend.standard_error, "{bend:?}");
    assert_eq!((found.missing, found.warnings), (Vec::<String>::new(), Vec::new()));
}

#[test]
fn an_image_like_no_other_is_left_out() {
    // In every run the image of the fourth press is wrong.
    let found = whole(2, |counts, press| {
        if press == 3 {
            counts.reverse();
        }
    });
    assert_eq!(found.spreads.iter().map(|spread| spread.left_out).sum::<usize>(), 4);
    for spread in &found.spreads {
        let truth = 2.22 + 0.497 * spread.covering_mm;
        assert!((spread.sigma_mm.value - truth).abs() < 4.0 * spread.sigma_mm.standard_error, "{spread:?}");
    }
}

#[test]
fn one_covering_gives_its_spread_and_no_line() {
    let mut sensor = SyntheticSensor::new(3);
    sensor.centres();
    let (declared, readings) = sensor.readings();
    let found = calibrate(&declared, &readings).unwrap();
    let thickness = found.thickness.as_ref().unwrap();
    assert!(thickness.linear.is_none() && thickness.quadratic.is_none());
    let sigma = thickness.coverings[0].sigma_mm;
    assert!((sigma.value - 2.724_952).abs() < 4.0 * sigma.standard_error, "{sigma:?}");
    assert!(found.missing.iter().any(|missing| missing.contains("one covering")), "{:?}", found.missing);
    // The declared slope stays.
    let (psf, errors) = found.psf(declared.model.psf()).unwrap();
    assert!((psf.sigma_per_mm - 0.4).abs() < 1e-15 && errors[1].is_none());
    assert!((psf.sigma_intercept_mm + 0.4 * 1.016 - sigma.value).abs() < 1e-12);
}

#[test]
fn nothing_measured_is_said_and_no_number_given() {
    let sensor = SyntheticSensor::new(4);
    let (declared, readings) = sensor.readings();
    let found = calibrate(&declared, &readings).unwrap();
    assert!(found.registration.is_none() && found.response.is_none() && found.thickness.is_none());
    assert!(found.missing.len() >= 3, "{:?}", found.missing);
    assert!(
        found.psf(declared.model.psf()).is_none() && found.responses(declared.model.response()).is_none()
    );
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        // The debug output of a number determines all of its bits.
        pool.install(|| format!("{:?}", whole(5, |_, _| ())))
    };
    assert_eq!(on(1), on(3));
}
