use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{clearest, clearest_beside_rhythm, most_per_count};
use crate::search::cells::{Point, points};

#[test]
fn a_tone_is_found_at_values_that_are_not_spaced_evenly() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let values: Vec<f64> = (0..3000).map(|_| rng.random_range(-20.0..50.0_f64)).collect();
    let noise: Vec<f64> = values.iter().map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut made = points(&values, |value| 0.4 * (std::f64::consts::TAU * 1.37 * value + 0.8).sin());
    made.iter_mut().zip(&noise).for_each(|(point, noise)| point.wanted += noise);
    let tone = clearest(&made.into_iter(), f64::INFINITY).unwrap();
    // A fifth of the resolution, one period in the range.
    assert!((tone.per_unit - 1.37).abs() < 0.2 / 70.0, "{tone:?}");
}

/// Without noise the place of the greatest power is that of the tone, but for what the cells blur: a hundredth of a period over all the data.
#[test]
fn a_clear_tone_is_found_to_a_hundredth_of_a_period() {
    let values: Vec<f64> = (0..6000).map(|frame| f64::from(frame) / 30.0).collect();
    for per_unit in [0.913_4, 2.271_77, 7.3061] {
        let made = points(&values, |value| (std::f64::consts::TAU * per_unit * value + 0.3).sin());
        let tone = clearest(&made.into_iter(), f64::INFINITY).unwrap();
        assert!((tone.per_unit - per_unit).abs() * 200.0 < 0.01, "{per_unit}: {tone:?}");
    }
}

#[test]
fn a_constant_residual_has_no_tone_where_the_weights_have_one() {
    let tau = std::f64::consts::TAU;
    let made = (0..2000).map(f64::from).map(|value| {
        let square = 1.0 + 0.9 * (tau * 0.1 * value).cos();
        Point { value, wanted: square * (100.0 + 0.05 * (tau * 0.031 * value).sin()), square }
    });
    let tone = clearest(&made, f64::INFINITY).unwrap();
    assert!((tone.per_unit - 0.031).abs() < 0.2 / 2000.0, "{tone:?}");
}

/// A second of each three is spent in contact. What swings after each stop has tones at thirds of a hertz; a hum has its own.
#[test]
fn what_every_press_repeats_is_no_tone_in_time() {
    let swings = |value: f64| {
        let since_s = value.rem_euclid(3.0);
        (-since_s / 0.5).exp() * (std::f64::consts::TAU * 4.3 * since_s).sin()
    };
    let hum = |value: f64| 0.5 * (std::f64::consts::TAU * 2.217 * value).sin();
    let made = |hums: f64| {
        (0..4500).map(|frame| f64::from(frame) / 10.0).map(move |value| {
            let square = f64::from(u8::from(value.rem_euclid(3.0) < 1.0));
            Point { value, wanted: square * (swings(value) + hums * hum(value)), square }
        })
    };
    let tone = clearest(&made(0.0), f64::INFINITY).unwrap();
    assert!((tone.per_unit - 13.0 / 3.0).abs() < 1e-3, "{tone:?}");
    let tone = clearest_beside_rhythm(&made(1.0)).unwrap();
    assert!((tone.per_unit - 2.217).abs() < 5e-3, "{tone:?}");
}

#[test]
fn a_covariate_that_does_not_vary_has_no_tone() {
    assert!(clearest(&points(&[2.0; 40], |_| 1.0).into_iter(), f64::INFINITY).is_none());
}

/// A quiet signal between two codes is read as the nearer one, whatever the array is.
#[test]
fn the_rounding_of_a_converter_is_no_tone() {
    let values: Vec<f64> = (0..4000).map(|place| 0.0713 * f64::from(place)).collect();
    let made = points(&values, |value| value.round() - value + 0.1 * (0.2 * value).sin());
    let tone = clearest(&made.clone().into_iter(), f64::INFINITY).unwrap();
    assert!((tone.per_unit - 1.0).abs() < 1e-3, "{tone:?}");
    let tone = clearest(&made.into_iter(), most_per_count(1.0)).unwrap();
    assert!((tone.per_unit - 0.2 / std::f64::consts::TAU).abs() < 1e-3, "{tone:?}");
}

#[test]
fn a_range_of_few_steps_has_no_tone_in_counts() {
    let values: Vec<f64> = (0..40).map(|place| 0.1 * f64::from(place)).collect();
    assert!(clearest(&points(&values, f64::sin).into_iter(), most_per_count(1.0)).is_none());
}
