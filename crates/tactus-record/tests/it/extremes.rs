//! Numbers and times at the ends of their ranges, as damage or another program leaves them: every reader goes on.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;

use tactus_record::{Completeness, Timeline, confirmed_presses, info, recover, rows};
use tactus_schema::{
    MonoTime,
    pb::{RunEvent, run_event::Event},
};

use crate::synthetic::{Fed, Plan, Run};

/// A run that was never closed, with changed messages.
fn changed(path: &Path, change: impl Fn(usize, &mut Fed)) -> Run {
    let mut run = Plan { exit_status: None, ..Plan::short(1) }.make();
    run.fed.iter_mut().enumerate().for_each(|(at, fed)| change(at, fed));
    run.record(path).unwrap();
    run
}

#[test]
fn frame_numbers_that_jump_to_and_fro_are_counted() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    let run = changed(&path, |at, fed| {
        if let Fed::Frame(frame) = fed {
            frame.seq = if at % 2 == 0 { 0 } else { u64::MAX };
            frame.lost_before = u32::MAX;
        }
    });
    let info = info(&path).unwrap();
    assert_eq!(info.frames, run.frames().count() as u64);
    assert_eq!(info.frames_lost, u64::MAX);
}

#[test]
fn the_last_event_number_there_is_does_not_stop_a_recovery() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    changed(&path, |_, fed| {
        if let Fed::Event(event) = fed {
            event.seq = u64::MAX;
        }
    });
    assert_eq!(confirmed_presses(&path).unwrap(), []);
    assert!(Timeline::read(&path).unwrap().lacks_events());
    let recovery = recover(&path, dir.path().join("out.mcap")).unwrap();
    assert!(recovery.closed);
    assert_eq!(recovery.info.completeness, Completeness::Complete);
}

#[test]
fn reports_at_the_ends_of_time_give_positions_between_them() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    changed(&path, |at, fed| {
        if let Fed::Stage(state) = fed {
            state.t_mono_ns = if at % 2 == 0 { i64::MIN } else { i64::MAX };
        }
    });
    let timeline = Timeline::read(&path).unwrap();
    for at in [i64::MIN, -1, 0, 1, i64::MAX] {
        let position_mm = timeline.position_mm(MonoTime::from_ns(at)).unwrap();
        assert!(position_mm.iter().all(|mm| mm.is_finite()), "{at}: {position_mm:?}");
    }
    // Whatever the rows are worth, they are given or refused.
    drop(rows::visit(&[&path], |_, _| {}));
}

#[test]
fn frames_and_events_at_the_ends_of_time_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    changed(&path, |at, fed| {
        let ns = if at % 2 == 0 { i64::MIN } else { i64::MAX };
        match fed {
            Fed::Frame(frame) => frame.received.mono = MonoTime::from_ns(ns),
            Fed::Event(event) if !matches!(event.event, Some(Event::Started(_))) => event.t_mono_ns = ns,
            Fed::Event(_) | Fed::Stage(_) | Fed::Info(..) => {}
        }
    });
    assert!(info(&path).unwrap().duration_s > 0.0);
    drop(rows::visit(&[&path], |_, _| {}));
    assert!(recover(&path, dir.path().join("out.mcap")).unwrap().closed);
}

#[test]
fn events_of_several_runs_count_each_by_itself() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    let mut run = Plan::short(1).make();
    let (at, middle) = run
        .fed
        .iter()
        .enumerate()
        .filter_map(|(at, fed)| if let Fed::Event(event) = fed { Some((at, event.clone())) } else { None })
        .nth(3)
        .unwrap();
    // What a collection says of itself, between two events of the run.
    let other = RunEvent { seq: 0, run_id: "collection".into(), ..middle };
    run.fed.insert(at + 1, Fed::Event(other));
    run.record(&path).unwrap();
    assert!(!Timeline::read(&path).unwrap().lacks_events());
}
