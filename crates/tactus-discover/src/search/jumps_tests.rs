use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{CELLS, clearest};
use crate::search::cells::{Point, points};

#[test]
fn a_jump_is_found_under_noise() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let values: Vec<f64> = (0..3000).map(|_| rng.random_range(-20.0..50.0_f64)).collect();
    let noise: Vec<f64> = values.iter().map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut made = points(&values, |value| if value > 31.0 { 2.5 } else { 2.0 });
    made.iter_mut().zip(&noise).for_each(|(point, noise)| point.wanted += noise);
    let jump = clearest(&made.into_iter()).unwrap();
    assert!((jump.at - 31.0).abs() < 1.0, "{jump:?}");
    assert!(jump.among > 0.9 * CELLS as f64 && jump.among < CELLS as f64, "{jump:?}");
}

#[test]
fn a_constant_residual_has_no_jump_where_the_weights_have_one() {
    let made = (0..2000).map(f64::from).map(|value| {
        let square = if value > 400.0 { 9.0 } else { 1.0 };
        Point { value, wanted: square * (100.0 + if value > 1500.0 { 0.1 } else { 0.0 }), square }
    });
    let jump = clearest(&made).unwrap();
    assert!((jump.at - 1500.0).abs() < 2.0, "{jump:?}");
}

#[test]
fn a_covariate_that_does_not_vary_has_no_jump() {
    assert_eq!(clearest(&points(&[2.0; 40], |_| 1.0).into_iter()), None);
}

#[test]
fn a_place_with_few_readings_beyond_is_no_jump() {
    let values: Vec<f64> = (0..2000).map(f64::from).collect();
    let made = points(&values, |value| if value > 1995.0 { 1.0 } else { 0.0 });
    let jump = clearest(&made.into_iter()).unwrap();
    assert!(jump.at < 1991.0, "{jump:?}");
}
