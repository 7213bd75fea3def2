use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Point, clearest};

fn points(values: &[f64], residual: impl Fn(f64) -> f64) -> Vec<Point> {
    values.iter().map(|value| Point { value: *value, wanted: residual(*value), square: 1.0 }).collect()
}

#[test]
fn a_tone_is_found_at_values_that_are_not_spaced_evenly() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let values: Vec<f64> = (0..3000).map(|_| rng.random_range(-20.0..50.0_f64)).collect();
    let noise: Vec<f64> = values.iter().map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut made = points(&values, |value| 0.4 * (std::f64::consts::TAU * 1.37 * value + 0.8).sin());
    made.iter_mut().zip(&noise).for_each(|(point, noise)| point.wanted += noise);
    let tone = clearest(&made.into_iter()).unwrap();
    // A fifth of the resolution, one period in the range.
    assert!((tone.per_unit - 1.37).abs() < 0.2 / 70.0, "{tone:?}");
}

#[test]
fn a_constant_residual_has_no_tone_where_the_weights_have_one() {
    let tau = std::f64::consts::TAU;
    let made = (0..2000).map(f64::from).map(|value| {
        let square = 1.0 + 0.9 * (tau * 0.1 * value).cos();
        Point { value, wanted: square * (100.0 + 0.05 * (tau * 0.031 * value).sin()), square }
    });
    let tone = clearest(&made).unwrap();
    assert!((tone.per_unit - 0.031).abs() < 0.2 / 2000.0, "{tone:?}");
}

#[test]
fn a_covariate_that_does_not_vary_has_no_tone() {
    assert!(clearest(&points(&[2.0; 40], |_| 1.0).into_iter()).is_none());
}
