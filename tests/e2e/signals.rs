//! The signals that end a program: the tip is retracted and the recording closed first. Others do nothing.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use rustix::process::Signal;
use tactus_e2e::{Process, ServiceUnderTest, free_endpoint, repository, tactus};
use tempfile::TempDir;

const HOLD: &str = "def run(rig):
    tare()
    log('it presses now')
    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 600.0)
";

const ENDING: [Signal; 4] = [Signal::HUP, Signal::INT, Signal::QUIT, Signal::TERM];
const WITHOUT_EFFECT: [Signal; 4] = [Signal::USR1, Signal::USR2, Signal::PIPE, Signal::TSTP];

/// The recording says that the run was stopped, and by what.
fn assert_stopped(folder: &Path, recording: &Path, by: &str) {
    let info = tactus(folder, &["--json", "record", "info", &recording.display().to_string()]);
    assert_eq!(info.code, Some(0), "{info:?}");
    let info = info.json();
    assert_eq!(info["exit_status"], "stopped", "{info}");
    assert!(info.to_string().contains(by), "{by} in {info}");
}

#[test]
fn every_ending_signal_makes_the_service_retract_close_and_end_and_no_other_one_does_anything() {
    for (ending, name) in ENDING.into_iter().zip(["SIGHUP", "SIGINT", "SIGQUIT", "SIGTERM"]) {
        let lab = ServiceUnderTest::start(|rig| rig);
        let script = lab.script("hold.star", HOLD);
        let _client = lab.start_tactus(&["run", &script]);
        lab.wait_until_pressing();
        for signal in WITHOUT_EFFECT {
            lab.daemon.signal(signal);
        }
        lab.wait_until_pressing();
        lab.daemon.signal(ending);
        let recording = lab.recording();
        let ServiceUnderTest { mut mock, daemon, folder, .. } = lab;
        let (code, said) = daemon.wait();
        assert_eq!(code, Some(0), "{name}: {said}");
        assert_stopped(folder.path(), &recording, name);
        mock.type_line("truth");
        let truth = mock.wait_until(|line| line.starts_with('{'));
        let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
        assert!(truth["z_mm"].as_f64().unwrap() > 1.9, "{name}: {truth}");
    }
}

#[test]
fn every_ending_signal_makes_an_embedded_run_close_its_recording() {
    for (ending, name) in ENDING.into_iter().zip(["SIGHUP", "SIGINT", "SIGQUIT", "SIGTERM"]) {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("hold.star"), HOLD).unwrap();
        let args = ["--json", "run", "hold.star", "--embedded", "--real-time", "--no-report"];
        let mut run = Process::start("tactus", folder.path(), &args);
        run.wait_for("it presses now");
        run.signal(ending);
        let (code, said) = run.wait();
        assert_eq!(code, Some(1), "{name}: {said}");
        let run = fs::read_dir(folder.path().join("runs")).unwrap().next().unwrap().unwrap().path();
        assert_stopped(folder.path(), &run.join("recording.mcap"), name);
    }
}

#[test]
fn every_ending_signal_stops_a_stage_that_is_checked() {
    let folder = TempDir::new().unwrap();
    let rig = fs::read_to_string(repository("config/rigs/pty.toml")).unwrap();
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let args = ["rig", "--config", "rig.toml", "--link-dir", "mock"];
    let mut mock = Process::start("tactus-mock", folder.path(), &args);
    mock.wait_for("stage");
    let endpoint = free_endpoint();
    for ending in ENDING {
        let args = ["--endpoint", &endpoint, "stage", "check", "--rig", "rig.toml", "--home", "--yes"];
        let mut check = Process::start("tactus", folder.path(), &args);
        check.wait_for("to=Homing");
        check.signal(ending);
        let (code, said) = check.wait();
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains("not good: homing: "), "{said}");
        mock.type_line("truth");
        let truth = mock.wait_until(|line| line.starts_with('{'));
        assert!(truth.contains("\"moving\":false"), "{truth}");
    }
}
