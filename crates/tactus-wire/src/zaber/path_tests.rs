use super::{AxisMove, accel_setting, axis_move, speed_setting};
use crate::stage::Direction;
use crate::zaber::Axis;

const AXIS: Axis = Axis {
    device: 1,
    number: 1,
    um_per_microstep: 0.5,
    direction: Direction::Positive,
    origin_microsteps: 0,
    resolution: None,
};

#[test]
fn settings_are_scaled_as_in_the_manual() {
    assert_eq!(speed_setting(100_000.0), Some(163_840));
    assert_eq!(accel_setting(100_000_000.0), Some(16_384));
    // 0 would be no motion, or no limit.
    assert_eq!((speed_setting(0.1), accel_setting(1.0)), (Some(1), Some(1)));
    for none in [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e12] {
        assert_eq!(speed_setting(none), None, "{none}");
    }
}

#[test]
fn an_axis_gets_its_part() {
    let whole = axis_move(&AXIS, 20_000, 10.0, 10.0, 1.0, Some(10.0));
    assert_eq!(whole, Some(AxisMove { target_microsteps: 20_000, speed: 3277, accel: Some(3) }));
    let half = axis_move(&AXIS, -10_000, -5.0, 10.0, 1.0, None);
    assert_eq!(half, Some(AxisMove { target_microsteps: -10_000, speed: 1638, accel: None }));
}

#[test]
fn no_path_is_faster_than_asked() {
    // One unit of speed is 0.000305 mm/s here.
    assert_eq!(axis_move(&AXIS, 20_000, 10.0, 10.0, 0.000_3, None), None);
    assert!(axis_move(&AXIS, 20_000, 10.0, 10.0, 0.000_31, None).is_some());
    assert_eq!(axis_move(&AXIS, 2, 0.001, 10.0, 0.001, None).map(|axis_move| axis_move.speed), Some(1));
}
