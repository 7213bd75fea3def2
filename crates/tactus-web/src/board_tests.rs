use tactus_schema::pb::run_event::Event;

use super::*;

fn frame(seq: u64, counts: f32) -> pb::Frame {
    pb::Frame { seq, t_wall_ns: i64::try_from(seq).unwrap(), counts: vec![counts; 4], ..Default::default() }
}

fn stage(status: pb::StageStatus, z_mm: f64) -> pb::StageState {
    pb::StageState { status: status.into(), z_mm, ..Default::default() }
}

fn run(run_id: &str, phase: pb::RunPhase) -> pb::RunState {
    pb::RunState { run_id: run_id.into(), phase: phase.into(), ..Default::default() }
}

fn event(run_id: &str, seq: u64, t_wall_ns: i64, event: Event) -> pb::RunEvent {
    pb::RunEvent { run_id: run_id.into(), seq, t_wall_ns, event: Some(event), ..Default::default() }
}

/// A board with a second of frames and the tip up.
fn at_rest() -> Board {
    let mut board = Board { stage: Some(stage(pb::StageStatus::Idle, 2.0)), ..Board::default() };
    for seq in 1..=30 {
        board.on_frame(frame(seq, 100.0), 0);
    }
    board
}

#[test]
fn the_zero_of_a_page_that_opens_in_mid_press_is_the_runs_zero() {
    let mut board = at_rest();
    let tare = pb::TareDone { baseline_counts: vec![100.0; 4], ..Default::default() };
    board.on_event(&event("r1", 0, 31, Event::TareDone(tare)));
    board.run = Some(run("r1", pb::RunPhase::Running));
    board.on_frame(frame(40, 2_821.0), 0);
    assert_eq!(board.rig_json()["zero"]["counts"], json!([100.0, 100.0, 100.0, 100.0]));
    assert_eq!(board.rig_json()["zero"]["run_id"], "r1");
}

#[test]
fn a_zero_is_taken_at_rest_only() {
    let mut board = at_rest();
    board.take_zero().unwrap();
    // The tip has just come up: the last half second still has a frame of the press.
    let mut pressed = at_rest();
    pressed.stage = Some(stage(pb::StageStatus::Idle, -0.2));
    pressed.on_frame(frame(31, 2_000.0), 0);
    pressed.stage = Some(stage(pb::StageStatus::Idle, 2.0));
    pressed.on_frame(frame(32, 100.0), 0);
    assert!(pressed.take_zero().unwrap_err().contains("above the covering"));
    assert_eq!(board.rig_json()["zero"]["source"], "taken here");
    board.stage = Some(stage(pb::StageStatus::Idle, -0.2));
    assert!(board.take_zero().unwrap_err().contains("above the covering"));
    board.stage = Some(stage(pb::StageStatus::Unhomed, 2.0));
    assert!(board.take_zero().unwrap_err().contains("above the covering"), "the place is not to be trusted");
    board.stage = Some(stage(pb::StageStatus::Idle, 2.0));
    board.run = Some(run("r1", pb::RunPhase::Paused));
    assert!(board.take_zero().unwrap_err().contains("a run is in progress"));
    board.run = Some(run("r1", pb::RunPhase::Finished));
    board.on_frame(frame(40, 100.0), 0);
    assert!(board.take_zero().unwrap_err().contains("without a gap"));
}

#[test]
fn safety_news_is_past_once_its_run_is_over() {
    let mut board = Board::default();
    let is_past = |board: &Board| board.view_json()["safety"]["is_past"].clone();
    board.on_event(&event("r1", 0, 10, Event::Started(pb::RunStarted::default())));
    board.run = Some(run("r1", pb::RunPhase::Running));
    board.on_safety(pb::SafetyEvent { t_wall_ns: 20, rule: "load".into(), ..Default::default() });
    assert_eq!((is_past(&board), board.view_json()["safety"]["run_id"].clone()), (json!(false), json!("r1")));
    let fault = "the load was too great".to_owned();
    board.run = Some(pb::RunState { fault, ..run("r1", pb::RunPhase::Finished) });
    assert_eq!(is_past(&board), false, "it holds the rig until a reset");
    board.run = Some(run("r1", pb::RunPhase::Finished));
    assert_eq!(is_past(&board), true);
    board.on_event(&event("r2", 0, 30, Event::Started(pb::RunStarted::default())));
    board.run = Some(run("r2", pb::RunPhase::Running));
    assert_eq!(is_past(&board), true);
    assert_eq!(board.view_json()["safety"]["run_id"], "r1");
}

#[test]
fn without_a_service_nothing_that_was_known_is_shown_but_the_log_and_the_last_minutes() {
    let mut board = at_rest();
    board.connected("bench");
    for seq in 31..=60 {
        board.on_frame(frame(seq, 100.0), 0);
    }
    board.on_health(pb::Health { sensor_connected: true, ..Default::default() });
    board.on_health(pb::Health { sensor_connected: false, ..Default::default() });
    board.disconnected("the service of rig bench has ended", 70);
    board.disconnected("no service", 80);
    let view = board.view_json();
    assert_eq!(
        (&view["problem"], &view["run"], &view["health"]),
        (&json!("no service"), &Value::Null, &Value::Null)
    );
    assert_eq!(board.frame_json(), None);
    assert!(board.history.mean(60).is_some());
    let log = board.log.json_from(0).to_string();
    assert!(log.contains("DISCONNECTED") && log.contains("has ended"), "{log}");
    assert_eq!(board.log.next(), 2, "each once: {log}");
}

#[test]
fn frames_that_are_told_again_are_history_and_not_the_present() {
    let at_s = |seconds: i64| seconds * 1_000_000_000;
    let mut board = at_rest();
    board.on_health(pb::Health { t_mono_ns: at_s(10), ..Default::default() });
    board.stage = Some(pb::StageState { t_mono_ns: at_s(10), ..stage(pb::StageStatus::Idle, -0.3) });
    let of = |seq: u64, t_mono_ns: i64| pb::Frame { t_mono_ns, ..frame(seq, 100.0) };
    assert!(!board.on_frame(of(31, at_s(4)), 0));
    assert_eq!(board.frame.as_ref().map(|frame| frame.seq), Some(30));
    assert!(board.on_frame(of(32, at_s(10)), 0));
    assert_eq!(board.frame.as_ref().map(|frame| frame.seq), Some(32));
    // The tip was not deep when the old frame was taken.
    let bytes = board.history.bytes();
    let z_mm = |record: usize| {
        let at = 8 + record * (32 + 4 * 4) + 24;
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    };
    assert!(z_mm(30).is_nan() && (z_mm(31) + 0.3).abs() < 1e-6);
}
