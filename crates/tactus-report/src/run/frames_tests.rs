#![expect(clippy::float_cmp, reason = "these values are exact")]

use super::Intervals;

#[test]
fn quantiles_are_nearest_ranks() {
    let values: Vec<f64> = (1..=200).rev().map(f64::from).collect();
    let intervals = Intervals::of(&values).unwrap();
    let at = |share| intervals.quantile_ms(share);
    assert_eq!([at(0.0), at(0.5), at(0.99), at(1.0)], [1.0, 100.0, 198.0, 200.0]);
    // Variance of 1..n is (n^2 - 1) / 12.
    assert!((intervals.jitter_ms - (39_999.0_f64 / 12.0).sqrt()).abs() < 1e-9);
}

#[test]
fn one_interval_and_none() {
    let one = Intervals::of(&[33.0]).unwrap();
    assert_eq!([one.quantile_ms(0.0), one.quantile_ms(0.99), one.jitter_ms], [33.0, 33.0, 0.0]);
    assert_eq!(Intervals::of(&[]), None);
}
