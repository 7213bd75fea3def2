use super::*;

#[track_caller]
fn near(value: f64, want: f64) {
    assert!((value - want).abs() < 1e-8, "{value}, not {want}");
}

/// `python3 -c "from scipy.stats import binomtest as b; print(b(14, 500).proportion_ci(method='exact'))"`, scipy 1.17.1.
#[test]
fn the_interval_is_that_of_clopper_and_pearson() {
    let rate = Rate::new(14, 500);
    near(rate.share, 0.028);
    near(rate.interval[0], 0.015_390_600_7);
    near(rate.interval[1], 0.046_533_327_0);
}

/// The upper end for 0 of n is 1 - 0.025^(1/n).
#[test]
fn none_and_all_have_one_sided_intervals() {
    let end = 1.0 - 0.025_f64.powf(1.0 / 20.0);
    near(Rate::new(0, 20).interval[0], 0.0);
    near(Rate::new(0, 20).interval[1], end);
    near(Rate::new(20, 20).interval[0], 1.0 - end);
    near(Rate::new(20, 20).interval[1], 1.0);
    assert!(Rate::new(0, 0).share.is_nan());
}

#[test]
fn the_normal_distribution_has_its_known_values() {
    near(normal_share(0.0), 0.5);
    near(normal_share(1.959_963_985), 0.975);
    near(normal_share(-1.644_853_627), 0.05);
}

#[test]
fn a_quantile_lies_between_its_neighbours() {
    assert_eq!(quantile(vec![], 0.5), None);
    assert_eq!(quantile(vec![3.0, 1.0, 2.0], 0.5), Some(2.0));
    near(quantile(vec![0.0, 10.0], 0.05).unwrap_or_default(), 0.5);
    assert_eq!(quantile(vec![4.0, 8.0], 1.0), Some(8.0));
}
