use proptest::prelude::*;

use super::{Axis, Direction};

const AXIS: Axis = Axis {
    device: 1,
    number: 1,
    um_per_microstep: 0.5,
    direction: Direction::Positive,
    origin_microsteps: 1000,
    resolution: None,
};

#[test]
fn positions_are_counted_from_the_origin() {
    let down = Axis { direction: Direction::Negative, ..AXIS };
    assert_eq!((AXIS.position_mm(3000), down.position_mm(3000)), (1.0, -1.0));
    assert_eq!((AXIS.microsteps(1.0), down.microsteps(1.0)), (Some(3000), Some(-1000)));
    assert_eq!(AXIS.microsteps(0.0003), Some(1001));
    assert!(AXIS.position_mm(1000).is_sign_positive() && down.position_mm(1000).is_sign_positive());
}

#[test]
fn what_cannot_be_sent_is_no_position() {
    for mm in [f64::NAN, f64::INFINITY, 1e9, -1e9] {
        assert_eq!(AXIS.microsteps(mm), None, "{mm}");
    }
    assert!(AXIS.position_mm(i64::MIN).is_finite());
}

proptest! {
    #[test]
    fn whole_microsteps_are_kept(
        microsteps in -2_000_000_000..2_000_000_000i64,
        um_per_microstep in 0.001..10.0,
        origin_microsteps in -1_000_000..1_000_000i32,
        is_down: bool,
    ) {
        let direction = if is_down { Direction::Negative } else { Direction::Positive };
        let axis = Axis { um_per_microstep, direction, origin_microsteps, ..AXIS };
        prop_assert_eq!(axis.microsteps(axis.position_mm(microsteps)), Some(microsteps));
    }
}
