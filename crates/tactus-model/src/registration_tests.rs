use super::*;
use proptest::prelude::*;

#[test]
fn a_quarter_turn_maps_the_sensors_x_onto_the_robots_y() {
    let registration = Registration { origin_mm: [10.0, 20.0], rotation_deg: 90.0 };
    let [x, y] = registration.to_robot([1.0, 0.0]);
    assert!((x - 10.0).abs() < 1e-12 && (y - 21.0).abs() < 1e-12, "{x} {y}");
}

proptest! {
    #[test]
    fn there_and_back_is_the_same_point(ox in -50.0..50.0, oy in -50.0..50.0, a in -180.0..180.0, x in -20.0..20.0, y in -20.0..20.0) {
        let registration = Registration { origin_mm: [ox, oy], rotation_deg: a };
        let back = registration.to_sensor(registration.to_robot([x, y]));
        prop_assert!((back[0] - x).abs() < 1e-9 && (back[1] - y).abs() < 1e-9);
    }
}
