use super::*;

const FROM_MM: [f64; 3] = [1.0, 2.0, 3.0];
const TARGET_MM: [f64; 3] = [4.0, 2.0, -1.0];
const TOLERANCE_MM: f64 = 0.005;

/// 5 mm at 5 mm/s, sent at 1 s.
fn course(shape: Shape) -> Course {
    Course::new(Duration::from_secs(1), FROM_MM, TARGET_MM, 5.0, shape)
}

fn strays(shape: Shape, at_ms: u64, position_mm: [f64; 3]) -> bool {
    course(shape).strays(Duration::from_millis(at_ms), position_mm, TOLERANCE_MM)
}

#[test]
fn on_the_way_and_in_time_is_no_straying() {
    for (at_ms, position_mm) in [
        (1000, FROM_MM),
        (1001, [1.003, 2.0, 2.996]),
        (1500, [2.5, 2.007, 1.0]),
        (2000, TARGET_MM),
        (2000, [4.005, 2.0, -1.005]),
        (9000, FROM_MM),
    ] {
        assert!(!strays(Shape::Line, at_ms, position_mm), "{position_mm:?} at {at_ms}");
        assert!(!strays(Shape::Box, at_ms, position_mm), "{position_mm:?} at {at_ms}");
    }
}

#[test]
fn beyond_the_target_behind_the_start_or_ahead_of_the_speed_is_straying() {
    for (at_ms, position_mm) in [
        (9000, [4.0, 2.0, -1.02]),
        (9000, [1.0, 2.0, 3.02]),
        (9000, [2.0, 2.02, 2.0]),
        (1100, [1.6, 2.0, 2.2]),
        (9000, [f64::NAN, 2.0, 2.0]),
    ] {
        assert!(strays(Shape::Line, at_ms, position_mm), "{position_mm:?} at {at_ms}");
        assert!(strays(Shape::Box, at_ms, position_mm), "{position_mm:?} at {at_ms}");
    }
}

#[test]
fn axes_that_move_by_themselves_may_leave_the_line_and_not_the_box() {
    let late_z = [2.5, 2.0, 2.9];
    assert!(strays(Shape::Line, 1500, late_z));
    assert!(!strays(Shape::Box, 1500, late_z));
}
