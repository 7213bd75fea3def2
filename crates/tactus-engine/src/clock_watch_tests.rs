use super::*;

/// After so many seconds, with a device whose clock runs fast by 100 ppm.
fn watched_for(seconds: u32) -> [f64; 2] {
    let mut watch = ClockWatch::default();
    for second in 0..=seconds {
        let received = MonoTime::default().after(Duration::from_secs(second.into()));
        watch.take(received, f64::from(second) * 1.0001);
    }
    watch.offset_s().unwrap()
}

#[test]
fn a_drift_of_days_is_no_uncertainty() {
    let [least_s, greatest_s] = watched_for(86_400);
    assert!((least_s + 8.64).abs() < 1e-6, "the present offset: {least_s}");
    assert!(greatest_s - least_s < 0.013, "{least_s} to {greatest_s}");
}

#[test]
fn the_first_frames_count_until_there_are_later_ones() {
    assert_eq!(ClockWatch::default().offset_s(), None);
    let [least_s, greatest_s] = watched_for(61);
    assert!(greatest_s.abs() < 1e-9 && (least_s + 0.0061).abs() < 1e-9, "{least_s} to {greatest_s}");
}
