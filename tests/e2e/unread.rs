//! Programs whose log nobody reads: a full pipe, a terminal that is held.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use rustix::process::Signal;
use tactus_e2e::{Process, ServiceUnderTest};
use tactus_record::{Entry, Message};
use tactus_schema::pb::run_event::Event;
use tempfile::TempDir;

/// Logs more than any pipe holds, then holds a press.
const LOG_AND_HOLD: &str = "def run(rig):
    tare()
    for _ in range(200):
        log('x' * 4000)
    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 600.0)
";

fn is_retracted(recording: &std::path::Path) -> bool {
    tactus_record::read(recording).unwrap().any(|entry| match entry.unwrap() {
        Entry::Message { message: Message::Event(event), .. } => {
            matches!(event.event, Some(Event::Cleanup(cleanup)) if cleanup.retracted)
        }
        Entry::Message { .. } | Entry::Run(_) | Entry::Attachment(_) => false,
    })
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
    assert_eq!(code, Some(1), "{said}");
    assert!(lab.truth()["z_mm"].as_f64().unwrap() > 1.9);
}

#[test]
fn an_embedded_run_whose_output_nobody_reads_ends_and_stops() {
    let folder = TempDir::new().unwrap();
    let long = "def run(rig):\n    for _ in range(200):\n        log('x' * 4000)\n    wait(600.0)\n";
    std::fs::write(folder.path().join("long.star"), long).unwrap();
    let args = ["--json", "run", "long.star", "--embedded", "--no-report"];
    let (code, said) = Process::start_unread("tactus", folder.path(), &args).wait();
    assert_eq!(code, Some(0), "{said}");
}
