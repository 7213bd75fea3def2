use super::*;

/// Two elements over a hundred frames, from two functions of the frame.
fn rows(f: impl Fn(f64) -> [f64; 2]) -> Vec<f64> {
    (0..100).flat_map(|frame| f(f64::from(frame))).collect()
}

#[test]
fn what_recalibration_takes_up_separates_nothing() {
    let clean = rows(|t| [100.0 + t, 90.0 + 0.01 * t * t]);
    let with = rows(|t| [103.0 + 1.2 * t, 80.0 + 0.008 * t * t]);
    assert!(separation(&clean, &with, 2, 1.0) < 1e-9);
}

#[test]
fn what_is_left_counts_in_standard_deviations() {
    // A change by +1 and -1 in turn is upright on a constant; this signal is upright on it too.
    let sign = |t: f64| 1.0 - 2.0 * (t % 2.0);
    let clean = rows(|t| [(t / 2.0).floor(), 0.0]);
    let with = rows(|t| [(t / 2.0).floor() + 3.0 * sign(t), 3.0 * sign(t)]);
    let z = separation(&clean, &with, 2, 2.0);
    assert!((z - (200.0_f64 * 9.0).sqrt() / 2.0).abs() < 1e-9, "{z}");
}

#[test]
fn a_dead_element_is_no_recalibration() {
    let clean = rows(|t| [t, t]);
    let with = rows(|t| [0.0, t]);
    let spread = (0..100).map(|t| (f64::from(t) - 49.5).powi(2)).sum::<f64>();
    assert!((separation(&clean, &with, 2, 1.0) - 0.5 * spread.sqrt()).abs() < 1e-9);
}
