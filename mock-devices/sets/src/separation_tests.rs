use super::*;

/// Two elements over a hundred frames, from two functions of the frame.
fn rows(f: impl Fn(f64) -> [f64; 2]) -> Vec<f64> {
    (0..100).flat_map(|frame| f(f64::from(frame))).collect()
}

/// A change by +1 and -1 in turn.
fn sign(t: f64) -> f64 {
    1.0 - 2.0 * (t % 2.0)
}

#[test]
fn what_recalibration_takes_up_separates_nothing() {
    let clean = rows(|t| [100.0 + t, 90.0 + 0.01 * t * t]);
    let with = rows(|t| [103.0 + 1.2 * t, 80.0 + 0.008 * t * t]);
    assert!(Separation::new(&clean, &with, &clean, 2, 1.0).z < 1e-6);
}

#[test]
fn what_is_left_counts_in_standard_deviations() {
    // The change is orthogonal to a constant, and to this signal too.
    let clean = rows(|t| [(t / 2.0).floor(), 0.0]);
    let with = rows(|t| [(t / 2.0).floor() + 3.0 * sign(t), 3.0 * sign(t)]);
    let z = Separation::new(&clean, &with, &clean, 2, 2.0).z;
    assert!((z - (200.0_f64 * 9.0).sqrt() / 2.0).abs() < 1e-9, "{z}");
}

#[test]
fn a_dead_element_is_no_recalibration() {
    let clean = rows(|t| [t, t]);
    let with = rows(|t| [0.0, t]);
    let spread = (0..100).map(|t| (f64::from(t) - 49.5).powi(2)).sum::<f64>();
    let z = Separation::new(&clean, &with, &clean, 2, 1.0).z;
    assert!((z - 0.5 * spread.sqrt()).abs() < 1e-9, "{z}");
}

#[test]
fn a_loss_of_all_elements_is_one() {
    let clean = rows(|t| [t, 2.0 * t]);
    let with = rows(|t| [0.3 * t, 0.6 * t]);
    assert!(Separation::new(&clean, &with, &clean, 2, 1.0).z < 1e-6);
}

#[test]
fn another_spread_separates_until_the_spread_too_is_recalibrated() {
    let clean = rows(|t| [t, t]);
    let wider = rows(|t| [t + 0.1 * sign(t), t - 0.1 * sign(t)]);
    let with = rows(|t| [t + 2.0 * sign(t), t - 2.0 * sign(t)]);
    let Separation { z, z_beyond_spread, spread_steps } = Separation::new(&clean, &with, &wider, 2, 1.0);
    assert!((z - 800.0_f64.sqrt()).abs() < 0.01, "{z}");
    assert!(z_beyond_spread < 1e-4, "{z_beyond_spread}");
    assert!((spread_steps - 20.0).abs() < 0.1, "{spread_steps}");
}
