use tactus_schema::{FrameFlags, Rig, TimeStamp, WallTime};

use super::*;

fn supervisor() -> Supervisor {
    let rig = Rig::from_toml(include_str!("../../../config/rigs/sim.toml")).unwrap();
    let service = rig.service.clone().unwrap();
    Supervisor::new(&rig, &service)
}

fn at_ms(ms: i64) -> MonoTime {
    MonoTime::from_ns(ms * 1_000_000)
}

fn frame(ms: i64, counts: &[f32]) -> Frame {
    Frame {
        seq: 0,
        epoch: 0,
        device_tick: None,
        received: TimeStamp { mono: at_ms(ms), wall: WallTime::default() },
        counts: counts.into(),
        flags: FrameFlags::default(),
        lost_before: 0,
        simulated: true,
        bad_elements: [].into(),
    }
}

fn at_height(z_mm: f64) -> pb::StageState {
    pb::StageState { z_mm, status: pb::StageStatus::Idle.into(), ..Default::default() }
}

#[test]
fn repeated_taring_cannot_ratchet_the_force_limit_up() {
    let mut supervisor = supervisor();
    supervisor.set_reference(vec![100.0; 4]);
    assert_eq!(supervisor.on_frame(&frame(0, &[100.0, 1500.0, 100.0, 100.0])), None);
    supervisor.set_tare(vec![1500.0; 4]);
    let violation = supervisor.on_frame(&frame(33, &[1500.0, 2200.0, 1500.0, 1500.0])).unwrap();
    assert!(
        matches!(violation, Violation::ElementForce { element: 1, against: "the run's first zero", .. }),
        "{violation}"
    );
}

#[test]
fn many_elements_below_their_limit_are_still_too_much_together() {
    let mut supervisor = supervisor();
    supervisor.set_reference(vec![0.0; 48]);
    let violation = supervisor.on_frame(&frame(0, &[1000.0; 48])).unwrap();
    assert_eq!(violation.rule(), "sum-force");
}

#[test]
fn silence_counts_only_near_the_covering() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_frame(&frame(1000, &[])), None);
    assert_eq!(supervisor.on_report(&at_height(2.0)), None);
    assert_eq!(supervisor.on_time(at_ms(5000)), None);
    assert_eq!(supervisor.on_frame(&frame(5000, &[])), None);
    assert_eq!(supervisor.on_report(&at_height(-0.2)), None);
    assert_eq!(supervisor.on_time(at_ms(5099)), None);
    assert_eq!(supervisor.on_time(at_ms(5101)).unwrap().rule(), "silence");
}

#[test]
fn a_violation_is_told_once_until_rearmed() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_report(&at_height(-0.72)).unwrap().rule(), "depth");
    assert_eq!(supervisor.on_report(&at_height(-0.73)), None);
    supervisor.rearm(at_ms(0));
    assert_eq!(supervisor.on_report(&at_height(-0.73)).unwrap().rule(), "depth");
}

#[test]
fn rearming_gives_a_returning_sensor_its_full_time() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_report(&at_height(0.0)), None);
    assert!(supervisor.on_time(at_ms(200)).is_some());
    supervisor.rearm(at_ms(300));
    assert_eq!(supervisor.on_time(at_ms(350)), None);
    assert!(supervisor.on_time(at_ms(401)).is_some());
}

#[test]
fn a_stage_that_does_not_know_where_it_is_counts_as_where_it_was_last() {
    let lost = |z_mm| pb::StageState { z_mm, status: pb::StageStatus::Unhomed.into(), ..Default::default() };
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_report(&lost(0.0)), None);
    assert_eq!(supervisor.on_time(at_ms(500)), None, "nothing says yet that the tip is near");
    assert_eq!(supervisor.on_report(&at_height(-0.3)), None);
    assert_eq!(supervisor.on_report(&lost(5.0)), None);
    assert!(
        supervisor.on_time(at_ms(500)).is_some(),
        "the tip was pressed in when the stage lost its position"
    );
}

#[test]
fn a_sensor_that_falls_when_pressed_is_limited_too() {
    let rig = include_str!("../../../config/rigs/sim.toml")
        .replace("sensitivity_counts_per_mm = 1000.0", "sensitivity_counts_per_mm = -1000.0");
    let rig = Rig::from_toml(&rig).unwrap();
    let mut supervisor = Supervisor::new(&rig, &rig.service.clone().unwrap());
    supervisor.set_reference(vec![3000.0; 48]);
    assert_eq!(supervisor.on_frame(&frame(0, &[4000.0; 48])), None, "it rises when it is let go");
    let violation = supervisor.on_frame(&frame(33, &[900.0; 48])).unwrap();
    assert_eq!(violation.rule(), "element-force");
}

/// A frame in which elements were not read.
fn partly_read(ms: i64, counts: &[f32], bad: &[u32]) -> Frame {
    Frame { bad_elements: bad.into(), flags: FrameFlags::BAD_ELEMENTS, ..frame(ms, counts) }
}

#[test]
fn what_was_not_read_neither_trips_nor_hides_a_load() {
    let mut supervisor = supervisor();
    supervisor.set_reference(vec![10_000.0; 48]);
    let mut counts = [10_000.0; 48];
    counts[3] = f32::NAN;
    counts[4] = 60_000.0;
    counts[5] = 0.0;
    assert_eq!(supervisor.on_frame(&partly_read(0, &counts, &[4, 5])), None);
    // 45 elements rise by 900: their sum is over its limit, whatever the three others stand with.
    let mut counts = counts.map(|count| count + 900.0);
    counts[5] = -1e9;
    let violation = supervisor.on_frame(&partly_read(33, &counts, &[4, 5])).unwrap();
    assert_eq!(violation.rule(), "sum-force");
}

#[test]
fn an_element_that_falls_silent_near_the_covering_is_a_stop() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_frame(&partly_read(0, &[100.0; 4], &[2])), None);
    supervisor.set_reference(vec![100.0; 4]);
    assert_eq!(supervisor.on_report(&at_height(-0.2)), None);
    for ms in [33, 67, 100] {
        assert_eq!(supervisor.on_frame(&partly_read(ms, &[100.0; 4], &[1, 2])), None);
        assert_eq!(supervisor.on_time(at_ms(ms)), None, "a bad reading or three are borne");
    }
    assert_eq!(supervisor.on_frame(&partly_read(133, &[100.0; 4], &[1, 2])), None);
    let violation = supervisor.on_time(at_ms(134)).unwrap();
    assert!(matches!(violation, Violation::ElementSilence { element: 1, .. }), "{violation}");
}

#[test]
fn an_element_that_was_never_read_stops_nothing_until_it_has_a_zero() {
    let mut supervisor = supervisor();
    assert_eq!(supervisor.on_frame(&partly_read(0, &[0.0, 100.0], &[0])), None);
    supervisor.set_reference(vec![0.0, 100.0]);
    assert_eq!(supervisor.on_report(&at_height(-0.2)), None);
    assert_eq!(supervisor.on_frame(&frame(2000, &[9000.0, 100.0])), None, "its zero was never read");
    supervisor.set_tare(vec![9000.0, 100.0]);
    assert_eq!(supervisor.on_frame(&frame(2033, &[9000.0, 100.0])), None);
    let violation = supervisor.on_frame(&frame(2067, &[11_001.0, 100.0])).unwrap();
    assert!(
        matches!(violation, Violation::ElementForce { element: 0, against: "the tare", .. }),
        "{violation}"
    );
}
