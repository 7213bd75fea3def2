use proptest::prelude::*;

use super::*;

fn assert_close(got: f64, want: f64) {
    assert!((got - want).abs() < 1e-12, "{got} {want}");
}

#[test]
fn a_long_way_is_a_trapezoid() {
    // 10 mm at 20 mm/s and 500 mm/s2: 40 ms and 0.4 mm each to speed up and to brake, 9.2 mm of cruise.
    let profile = Profile::new(10.0, 0.0, 20.0, 500.0);
    assert_close(profile.duration_s(), 0.04 + 0.46 + 0.04);
    for (t_s, distance_mm, speed) in [
        (-1.0, 0.0, 0.0),
        (0.02, 0.1, 10.0),
        (0.04, 0.4, 20.0),
        (0.27, 5.0, 20.0),
        (0.52, 9.9, 10.0),
        (0.54, 10.0, 0.0),
        (9.0, 10.0, 0.0),
    ] {
        assert_close(profile.distance_at(t_s), distance_mm);
        assert_close(profile.speed_at(t_s), speed);
    }
}

#[test]
fn a_short_way_is_a_triangle() {
    // 0.2 mm at 500 mm/s2: 0.1 mm in sqrt(2 0.1 / 500) = 20 ms, twice; peak 10 mm/s.
    let profile = Profile::new(0.2, 0.0, 20.0, 500.0);
    assert_close(profile.duration_s(), 0.04);
    assert_close(profile.speed_at(0.02), 10.0);
    assert_close(profile.distance_at(0.02), 0.1);
}

#[test]
fn braking_takes_v_squared_over_2a() {
    let profile = Profile::brake(20.0, 500.0);
    assert_close(profile.distance_mm(), 0.4);
    assert_close(profile.duration_s(), 0.04);
    assert_close(profile.distance_at(0.02), 0.3);
}

#[test]
fn no_way_takes_no_time() {
    let profile = Profile::new(0.0, 0.0, 20.0, 500.0);
    assert_close(profile.duration_s(), 0.0);
    assert_close(profile.distance_at(1.0), 0.0);
    assert_close(profile.speed_at(0.0), 0.0);
    assert_close(Profile::brake(0.0, 500.0).duration_s(), 0.0);
}

proptest! {
    #[test]
    fn time_and_distance_are_inverse(
        distance in 0.001..50.0_f64, start in 0.0..20.0_f64, top in 0.1..50.0_f64, a in 50.0..2000.0_f64, share in 0.0..1.0_f64,
    ) {
        let distance = distance + start * start / (2.0 * a);
        let profile = Profile::new(distance, start, top, a);
        let gone = share * distance;
        prop_assert!((profile.distance_at(profile.time_at(gone)) - gone).abs() < 1e-9);
        prop_assert!((profile.distance_at(profile.duration_s()) - distance).abs() < 1e-9);
        prop_assert!(profile.speed_at(profile.duration_s() * share) <= top.max(start) + 1e-9);
    }
}
