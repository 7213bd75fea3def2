use super::*;

#[test]
fn what_is_not_known_is_left_out() {
    let board = Board { problem: "no service".into(), rig: "a\"b".into(), ..Board::default() };
    let text = metrics(&board);
    assert!(text.contains("tactus_service_connected{rig=\"a\\\"b\"} 0\n"), "{text}");
    assert!(text.contains("# TYPE tactus_dashboard_frames_missed_total counter\n"), "{text}");
    assert!(!text.contains("tactus_frames_total") && !text.contains("tactus_tip"), "{text}");
}

#[test]
fn a_lab_in_service_tells_frames_tip_and_verdict() {
    let health = pb::Health { frames: 7, frames_lost: 2, sensor_connected: true, ..pb::Health::default() };
    let stage = pb::StageState { z_mm: 2.5, ..pb::StageState::default() };
    let mut safety = pb::SafetyEvent::default();
    safety.set_verdict(pb::SafetyVerdict::Stopped);
    let board = Board {
        rig: "sim".into(),
        health: Some(health),
        stage: Some(stage),
        safety: Some(safety),
        ..Board::default()
    };
    let text = metrics(&board);
    for line in [
        "tactus_frames_total{rig=\"sim\"} 7",
        "tactus_frames_lost_total{rig=\"sim\"} 2",
        "tactus_sensor_connected{rig=\"sim\"} 1",
        "tactus_tip_millimetres{rig=\"sim\",axis=\"z\"} 2.5",
        "tactus_safety_verdict{rig=\"sim\",verdict=\"stopped\"} 1",
        "tactus_safety_verdict{rig=\"sim\",verdict=\"clear\"} 0",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
}
