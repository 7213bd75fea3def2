//! Programs whose log nobody reads: a full pipe, a terminal that is held.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::path::Path;

use rustix::process::Signal;
use tactus_e2e::{Process, ServiceUnderTest, until};
use tactus_record::{Entry, Message};
use tactus_schema::pb::{Phase, run_event::Event};
use tempfile::TempDir;

/// Logs more than any pipe holds, then holds a press.
const LOG_AND_HOLD: &str = "def run(rig):
    tare()
    for _ in range(200):
        log('x' * 4000)
    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 600.0)
";

/// The events of a recording, which may still be written.
fn events(recording: &Path) -> impl Iterator<Item = Event> {
    tactus_record::read(recording).into_iter().flatten().map_while(Result::ok).filter_map(|entry| match entry
    {
        Entry::Message { message: Message::Event(event), .. } => event.event,
        Entry::Message { .. } | Entry::Run(_) | Entry::Attachment(_) => None,
    })
}

fn is_retracted(recording: &Path) -> bool {
    events(recording).any(|event| matches!(event, Event::Cleanup(cleanup) if cleanup.retracted))
}

fn holds(recording: &Path) -> bool {
    events(recording).any(|event| matches!(event, Event::PhaseChanged(now) if now.phase() == Phase::Hold))
}

#[test]
fn a_service_whose_log_nobody_reads_stops_at_sigterm_with_the_tip_up() {
    let mut lab = ServiceUnderTest::start_unread(|rig| rig);
    let script = lab.script("hold.star", LOG_AND_HOLD);
    let _client = lab.start_tactus(&["run", &script]);
    lab.wait_until_pressing();
    assert!(lab.truth()["depth_mm"].as_f64().unwrap() > 0.1);
    let recording = lab.recording();
    lab.daemon.signal(Signal::TERM);
    let ServiceUnderTest { mut mock, daemon, .. } = lab;
    assert_eq!(daemon.wait().0, Some(0));
    mock.type_line("truth");
    let truth: serde_json::Value =
        serde_json::from_str(&mock.wait_until(|line| line.starts_with('{'))).unwrap();
    assert!(truth["z_mm"].as_f64().unwrap() > 1.9 && truth["moving"] == false, "{truth}");
    assert!(is_retracted(&recording));
}

#[test]
fn a_service_whose_log_nobody_reads_sees_its_sensor_go() {
    let mut lab = ServiceUnderTest::start_unread(|rig| rig.replace("\"repeat\"", "\"fail\""));
    let script = lab.script("hold.star", LOG_AND_HOLD);
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    lab.wait_until_pressing();
    lab.mock.type_line("sensor disconnect 60s");
    let (code, said) = client.wait();
    let truth = lab.truth();
    assert_eq!(code, Some(1), "{said}\n{truth}");
    assert!(truth["z_mm"].as_f64().unwrap() > 1.9, "{said}\n{truth}");
}

#[test]
fn an_embedded_run_whose_output_nobody_reads_is_done_all_the_same() {
    let folder = TempDir::new().unwrap();
    let long = "def run(rig):\n    for _ in range(200):\n        log('x' * 4000)\n    wait(600.0)\n";
    std::fs::write(folder.path().join("long.star"), long).unwrap();
    for start in [Process::start_unread, Process::start_at_held_terminal] {
        // At a terminal it also draws a progress bar.
        let (code, said) =
            start("tactus", folder.path(), &["run", "long.star", "--embedded", "--no-report"]).wait();
        assert_eq!(code, Some(0), "{said}");
        assert!(said.contains("ended      done"), "{said}");
    }
}

#[test]
fn an_embedded_run_at_a_held_terminal_stops_when_that_is_closed() {
    let folder = TempDir::new().unwrap();
    let hold = "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 600.0)\n";
    std::fs::write(folder.path().join("hold.star"), hold).unwrap();
    let args = ["run", "hold.star", "--embedded", "--real-time", "--no-report"];
    let run = Process::start_at_held_terminal("tactus", folder.path(), &args);
    // It can say nothing; what it records is the sign that it presses.
    let recording = until("it presses", || {
        let run = std::fs::read_dir(folder.path().join("runs")).ok()?.next()?;
        Some(run.unwrap().path().join("recording.mcap")).filter(|path| holds(path))
    });
    run.signal(Signal::HUP);
    let (code, said) = run.wait();
    assert_eq!(code, Some(1), "{said}");
    assert!(is_retracted(&recording));
}
