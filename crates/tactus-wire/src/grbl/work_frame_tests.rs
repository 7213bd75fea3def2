#![expect(clippy::float_cmp, reason = "sums of numbers that are exact in binary")]

use super::*;

fn take(frame: &mut WorkFrame, line: &str) -> [f64; 3] {
    frame.take(&StatusReport::parse(line).unwrap())
}

#[test]
fn a_position_is_the_same_in_either_frame() {
    let mut frame = WorkFrame::default();
    assert_eq!(take(&mut frame, "<Idle|MPos:1.000,2.000,3.000|WCO:0.500,0.000,-2.000>"), [1.0, 2.0, 3.0]);
    assert_eq!(take(&mut frame, "<Idle|WPos:0.500,2.000,5.000>"), [1.0, 2.0, 3.0]);
    assert_eq!(frame.foreign_mm(), Some([0.5, 0.0, -2.0]));
}

#[test]
fn a_work_position_without_its_frame_is_unknown_until_the_frame_is_told() {
    let mut frame = WorkFrame::default();
    take(&mut frame, "<Idle|MPos:1.000,2.000,3.000>");
    assert!(!frame.is_unknown());
    take(&mut frame, "<Idle|WPos:1.000,2.000,3.000>");
    assert!(frame.is_unknown());
    take(&mut frame, "<Idle|WPos:1.000,2.000,3.000|WCO:0.000,0.000,0.000>");
    assert!(!frame.is_unknown() && frame.foreign_mm().is_none());
    frame.forget();
    take(&mut frame, "<Idle|WPos:1.000,2.000,3.000>");
    assert!(frame.is_unknown());
}
