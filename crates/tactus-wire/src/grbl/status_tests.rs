use proptest::prelude::*;

use super::{MachineState, Position, StatusError, StatusReport};

/// The line that the real firmware's host build was seen to send.
#[test]
fn golden_line() {
    let line = "<Run|MPos:4.716,2.828,-0.944|Bf:99,1023|FS:109,0>";
    let report = StatusReport {
        state: MachineState::Run,
        position: Position::Machine([4.716, 2.828, -0.944]),
        work_offset_mm: None,
        buffer: Some([99, 1023]),
        feed_mm_per_min: Some(109.0),
    };
    assert_eq!(StatusReport::parse(line), Ok(report.clone()));
    assert_eq!(report.to_string(), line);
}

#[test]
fn fields_come_and_go() {
    let report = StatusReport::parse(
        "<Idle|WPos:0.000,0.000,0.000,90.000|WCO:1.000,2.000,-3.500|Ov:100,100,100|Pn:Z>",
    );
    let report = report.unwrap();
    assert_eq!(report.position, Position::Work([0.0; 3]));
    assert_eq!(report.work_offset_mm, Some([1.0, 2.0, -3.5]));
    assert_eq!((report.buffer, report.feed_mm_per_min), (None, None));
}

#[test]
fn a_hold_is_complete_only_at_zero() {
    let state =
        |state: &str| StatusReport::parse(&format!("<{state}|MPos:0,0,0>")).map(|report| report.state);
    assert_eq!(state("Hold:1"), Ok(MachineState::Holding));
    assert_eq!(state("Hold:0"), Ok(MachineState::Hold));
    assert_eq!(state("Hold"), Ok(MachineState::Holding));
    assert_eq!(state("Alarm:11"), Ok(MachineState::Alarm));
    assert_eq!(state("Dance"), Err(StatusError::State("Dance".into())));
}

#[test]
fn broken_reports_are_refused() {
    let error = |line: &str| StatusReport::parse(line).unwrap_err();
    assert_eq!(error("<Idle|MPos:0.000,0.000,0.000"), StatusError::Brackets);
    assert_eq!(error("Idle|MPos:0.000,0.000,0.000>"), StatusError::Brackets);
    assert_eq!(error("<Idle>"), StatusError::NoPosition);
    assert_eq!(error("<Idle|MPos:0.000,0.000>"), StatusError::Field("MPos:0.000,0.000".into()));
    assert_eq!(error("<Idle|MPos:0.000,nan,0.000>"), StatusError::Field("MPos:0.000,nan,0.000".into()));
    assert_eq!(error("<Idle|MPos:0.000,inf,0.000>"), StatusError::Field("MPos:0.000,inf,0.000".into()));
    assert_eq!(error("<Idle|MPos>"), StatusError::Field("MPos".into()));
}

fn state() -> impl Strategy<Value = MachineState> {
    use MachineState::{Alarm, Check, Door, Hold, Holding, Home, Idle, Jog, Run, Sleep, Tool};
    prop::sample::select(vec![Idle, Run, Holding, Hold, Jog, Alarm, Door, Check, Home, Sleep, Tool])
}

fn micrometres() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3((-999_999..999_999).prop_map(|um: i32| f64::from(um) / 1000.0))
}

proptest! {
    #[test]
    fn round_trip(
        state in state(),
        machine: bool,
        mm in micrometres(),
        work_offset_mm in prop::option::of(micrometres()),
        buffer: Option<[u32; 2]>,
        feed: Option<u16>,
    ) {
        let position = if machine { Position::Machine(mm) } else { Position::Work(mm) };
        let feed_mm_per_min = feed.map(f64::from);
        let report = StatusReport { state, position, work_offset_mm, buffer, feed_mm_per_min };
        prop_assert_eq!(StatusReport::parse(&report.to_string()), Ok(report));
    }

    #[test]
    fn any_line_is_read_or_refused(line in "<?(Idle|Run)?[|:,0-9a-zA-Z.<>-]{0,40}>?") {
        if let Ok(report) = StatusReport::parse(&line) {
            let (Position::Machine(mm) | Position::Work(mm)) = report.position;
            prop_assert!(mm.iter().all(|value| value.is_finite()));
        }
    }
}
