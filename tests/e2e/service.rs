//! The service against virtual devices on pseudo-terminals, in real time.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::net::TcpStream;
use std::path::{Path, PathBuf};

use rustix::process::Signal;
use serde_json::Value;
use tactus_e2e::{Process, ServiceUnderTest, free_endpoint, repository, tactus, until};
use tactus_record::{Entry, Message};
use tactus_schema::pb::{self, run_event::Event};

const HOLD: &str = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 600.0)\n";
const PRESSES: &str =
    "def run(rig):\n    tare()\n    for i in range(4):\n        press(5.0, 5.0, depths_mm = [0.2, 0.4])\n";
const LONG_DWELL: &str = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.3], dwell_s = 3.0)\n";

fn messages(recording: &Path) -> Vec<Message> {
    let entries = tactus_record::read(recording).unwrap();
    entries
        .filter_map(|entry| match entry.unwrap() {
            Entry::Message { message, .. } => Some(message),
            Entry::Run(_) | Entry::Attachment(_) => None,
        })
        .collect()
}

fn events(recording: &Path) -> Vec<Event> {
    let of_run = |message| if let Message::Event(event) = message { event.event } else { None };
    messages(recording).into_iter().filter_map(of_run).collect()
}

fn recording(lab: &ServiceUnderTest) -> PathBuf {
    lab.recording()
}

/// Waits until the live frames show a press.
fn wait_until_pressing(lab: &ServiceUnderTest) {
    lab.wait_until_pressing();
}

/// The service's state.
fn status(lab: &ServiceUnderTest) -> Value {
    let said = lab.tactus(&["--json", "status"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    said.json()
}

/// True position of the tip, from the virtual stage.
fn truth(lab: &mut ServiceUnderTest) -> Value {
    lab.truth()
}

#[test]
fn a_run_started_by_the_cli_is_done_and_recorded() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let script = lab.script("presses.star", PRESSES);
    let said = lab.tactus(&["--json", "run", &script]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let summary = said.json();
    assert_eq!(
        (&summary["presses"], &summary["dwells"], &summary["frames_lost"]),
        (&4.into(), &8.into(), &0.into())
    );
    assert_eq!(summary["embedded"], false);
    let frames = messages(Path::new(summary["recording"].as_str().unwrap()))
        .iter()
        .filter(|message| matches!(message, Message::Frame(_)))
        .count();
    assert_eq!(frames as u64, summary["frames"].as_u64().unwrap());
    assert!(Path::new(summary["report"].as_str().unwrap()).is_file());
    let said = lab.tactus(&["run", &script, "--truth", "model.toml"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("has devices of its own: add --embedded"), "{said:?}");
}

/// The shipped rig whose sensor sends described frames. Its description stays in its place.
fn described(_: String) -> String {
    let rig = fs::read_to_string(repository("config/rigs/pty-declared.toml")).unwrap();
    let link = repository("config/links/digitacts.toml").display().to_string();
    rig.replace("../links/digitacts.toml", &link)
}

#[test]
fn a_sensor_whose_frames_are_described_is_read_and_recorded_with_its_description() {
    let mut lab = ServiceUnderTest::start(described);
    let script = lab.script("presses.star", PRESSES);
    let said = lab.tactus(&["--json", "run", &script, "--no-report"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let summary = said.json();
    assert_eq!((&summary["presses"], &summary["frames_lost"]), (&4.into(), &0.into()));
    let recording = PathBuf::from(summary["recording"].as_str().unwrap());
    let told = messages(&recording);
    let info = told
        .iter()
        .find_map(|message| if let Message::SensorInfo(info) = message { Some(info) } else { None });
    let info = info.expect("what the sensor says of itself");
    assert_eq!((info.link.as_str(), info.tick_ns, info.simulated), ("declared, digitacts", 1_000_000, true));
    let frames: Vec<_> = told
        .iter()
        .filter_map(|message| if let Message::Frame(frame) = message { Some(frame) } else { None })
        .collect();
    assert_eq!(frames.len() as u64, summary["frames"].as_u64().unwrap());
    assert!(frames.iter().all(|frame| frame.counts.len() == 48 && frame.bad_elements.is_empty()));
    assert!(
        frames.iter().any(|frame| frame.counts.iter().any(|count| *count > 250.0)),
        "something was pressed"
    );
    let kept = tactus_record::read(&recording).unwrap().find_map(|entry| match entry.unwrap() {
        Entry::Attachment(attachment) if attachment.name == "link.toml" => Some(attachment.data),
        Entry::Attachment(_) | Entry::Message { .. } | Entry::Run(_) => None,
    });
    assert_eq!(kept, Some(fs::read(repository("config/links/digitacts.toml")).unwrap()));

    // Lost frames are counted by the device's own counter, and the press is repeated.
    fs::remove_dir_all(lab.folder.path().join("runs")).unwrap();
    let script = lab.script("long.star", LONG_DWELL);
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    wait_until_pressing(&lab);
    lab.mock.type_line("sensor drop-frames 2");
    let (code, said) = client.wait();
    assert_eq!(code, Some(3), "{said}");
    let lost: Vec<_> = events(&self::recording(&lab))
        .into_iter()
        .filter_map(|event| if let Event::Gap(gap) = event { Some(gap.frames_lost) } else { None })
        .collect();
    assert_eq!(lost, [2]);
}

#[test]
fn sigterm_in_the_middle_of_a_press_retracts_and_closes_the_recording() {
    let lab = ServiceUnderTest::start(|rig| rig);
    let script = lab.script("hold.star", HOLD);
    let _client = lab.start_tactus(&["run", &script]);
    wait_until_pressing(&lab);
    let recording = recording(&lab);
    lab.daemon.signal(Signal::TERM);
    let (code, said) = lab.daemon.wait();
    assert_eq!(code, Some(0), "{said}");

    let info = tactus(lab.folder.path(), &["--json", "record", "info", &recording.display().to_string()]);
    assert_eq!(info.code, Some(0), "{info:?}");
    assert_eq!(info.json()["exit_status"], "stopped");
    let cleanup = events(&recording)
        .into_iter()
        .find_map(|event| if let Event::Cleanup(cleanup) = event { Some(cleanup) } else { None });
    let cleanup = cleanup.expect("a clean-up event");
    assert!(cleanup.retracted && (cleanup.z_mm - 2.0).abs() < 0.01, "{cleanup:?}");
}

#[test]
fn a_sensor_that_goes_for_two_seconds_is_a_gap_of_twenty_frames_and_the_press_is_repeated() {
    let mut lab = ServiceUnderTest::start(|rig| rig);
    let script = lab.script("long.star", LONG_DWELL);
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    wait_until_pressing(&lab);
    lab.mock.type_line("sensor disconnect 2s");
    let (code, said) = client.wait();
    assert_eq!(code, Some(3), "{said}");

    let recording = recording(&lab);
    let events = events(&recording);
    let gaps: Vec<_> = events
        .iter()
        .filter_map(|event| if let Event::Gap(gap) = event { Some(gap) } else { None })
        .collect();
    assert_eq!(gaps.len(), 1, "{gaps:?}");
    // Two seconds without the device, at 10 Hz, and the time for the driver to find it again.
    assert!((19..=37).contains(&gaps[0].frames_lost), "{gaps:?}");
    assert_eq!(gaps[0].next_seq - gaps[0].after_seq - 1, gaps[0].frames_lost);
    assert!(events.iter().any(|event| matches!(event, Event::PressRepeated(_))));
    let Some(Event::Finished(finished)) = events.last() else { panic!("{events:?}") };
    assert_eq!(finished.exit_status(), pb::ExitStatus::Degraded);
    assert_eq!((finished.presses, finished.frames_lost), (1, gaps[0].frames_lost));
}

#[test]
fn where_the_policy_says_fail_a_lost_sensor_fails_the_run_with_the_tip_up() {
    let mut lab = ServiceUnderTest::start(|rig| rig.replace("on_gap = \"repeat\"", "on_gap = \"fail\""));
    let script = lab.script("hold.star", HOLD);
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    wait_until_pressing(&lab);
    lab.mock.type_line("sensor disconnect 2s");
    let (code, said) = client.wait();
    assert_eq!(code, Some(1), "{said}");
    let events = events(&recording(&lab));
    assert!(
        events.iter().any(|event| matches!(event, Event::Cleanup(cleanup) if cleanup.retracted)),
        "{events:?}"
    );
}

#[test]
fn a_plan_is_for_the_rig_that_would_run_it_with_the_covering_in_place() {
    let lab = ServiceUnderTest::start(|rig| {
        let rig = rig.replace("x_mm = [10.0, 50.0]", "x_mm = [10.0, 30.0]");
        assert!(rig.contains("[10.0, 30.0]"), "the rig file has changed");
        rig
    });
    let far = lab.script("far.star", "def run(rig):\n    press(14.0, 5.0, depths_mm = [0.2])\n");
    let said = lab.tactus(&["--json", "plan", &far]);
    assert_eq!(said.code, Some(4), "{said:?}");
    let plan = said.json();
    assert_eq!((&plan["possible"], &plan["rig"]), (&false.into(), &"bench".into()));
    assert_eq!(plan["rig_of"], format!("of the service at {}", lab.endpoint));
    assert_eq!(lab.tactus(&["run", &far]).code, Some(4), "a run agrees with its plan");
    assert_eq!(lab.tactus(&["plan", &far, "--embedded"]).code, Some(0));
}

#[test]
fn stop_pause_and_resume_work_from_another_client() {
    let lab = ServiceUnderTest::start(|rig| rig);
    assert_eq!(lab.tactus(&["pause"]).code, Some(1), "no run can be paused");
    assert_eq!(lab.tactus(&["stop"]).code, Some(0), "stop is never refused");

    // Long enough for slow machines: it is stopped in the end.
    let script = lab.script("presses.star", &PRESSES.replace("range(4)", "range(400)"));
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    wait_until_pressing(&lab);
    let held = lab.tactus(&["pause"]);
    assert_eq!(held.code, Some(5), "the client that runs the experiment holds the lease: {held:?}");
    assert!(held.err.contains("holds the lease") && held.err.contains("--take-over"), "{held:?}");
    let pause = lab.tactus(&["pause", "--take-over", "to look"]);
    assert_eq!(pause.code, Some(0));
    let pauses = ["pauses before its next step", "paused: `tactus resume` goes on"];
    assert!(pauses.iter().any(|words| pause.out.contains(words)), "{pause:?}");
    let paused =
        until("it is paused", || Some(status(&lab)).filter(|status| status["run"]["phase"] == "paused"));
    assert!(paused["stage"]["z_mm"].as_f64().unwrap() > 1.9, "a paused rig presses nothing: {paused}");
    assert_eq!(lab.tactus(&["run", &script]).code, Some(5), "one run at a time");
    let resumed = lab.tactus(&["resume"]);
    assert_eq!(resumed.code, Some(0));
    assert!(resumed.out.contains(": running;") && !resumed.out.contains("paused"), "{resumed:?}");
    wait_until_pressing(&lab);
    assert_eq!(lab.tactus(&["stop", "--abort", "--reason", "wrong covering"]).code, Some(0));
    let (code, said) = client.wait();
    assert_eq!(code, Some(1), "{said}");
    let after = lab.tactus(&["status"]);
    assert!(after.out.contains(": aborted by ") && !after.out.contains("aborted aborted"), "{after:?}");
    assert!(after.out.contains("safety") && after.out.contains("depth limit 0.711 mm under the 1.016 mm"));
    let events = events(&recording(&lab));
    let Some(Event::Finished(finished)) = events.last() else { panic!("{events:?}") };
    assert_eq!(finished.exit_status(), pb::ExitStatus::Aborted);
    assert!(finished.message.contains("wrong covering"), "{finished:?}");
    let is_takeover = |event: &Event| matches!(event, Event::LeaseTaken(taken) if taken.reason == "to look");
    assert!(events.iter().any(is_takeover), "{events:?}");
    assert!(events.iter().any(|event| matches!(event, Event::Paused(paused) if !paused.by.is_empty())));
    assert!(events.iter().any(|event| matches!(event, Event::Resumed(resumed) if !resumed.by.is_empty())));
}

#[test]
fn a_service_that_is_killed_leaves_a_recording_that_lacks_at_most_a_second_and_closes_it_at_its_next_start() {
    let mut lab = ServiceUnderTest::start(|rig| rig);
    let script = lab.script("hold.star", HOLD);
    let _client = lab.start_tactus(&["run", &script]);
    wait_until_pressing(&lab);
    let recording = recording(&lab);
    let before = status(&lab)["run"]["frames"].as_u64().unwrap();
    lab.daemon.signal(Signal::KILL);
    let (code, _) = lab.daemon.wait();
    assert_eq!(code, None);
    let frames =
        messages(&recording).iter().filter(|message| matches!(message, Message::Frame(_))).count() as u64;
    assert!(frames + 30 >= before, "{frames} of {before}");
    let info = tactus(lab.folder.path(), &["record", "info", &recording.display().to_string()]);
    assert_eq!(info.code, Some(3), "{info:?}");

    lab.daemon = Process::start("tactusd", lab.folder.path(), &["--config", "tactusd.toml"]);
    lab.daemon.wait_for("MAY STAND IN CONTACT");
    lab.daemon.wait_for("ready");
    let info = tactus(lab.folder.path(), &["--json", "record", "info", &recording.display().to_string()]);
    assert_eq!(info.code, Some(0), "{info:?}");
    let info = info.json();
    assert_eq!((&info["exit_status"], info["frames"].as_u64()), (&"crashed".into(), Some(frames)));
    assert!(info["message"].as_str().unwrap().contains("the stage last reported the tip at z = "), "{info}");
}

#[test]
fn after_a_start_nothing_moves_before_an_explicit_reset() {
    let mut lab = ServiceUnderTest::start_only(|rig| rig);
    let presses = lab.script("presses.star", PRESSES);
    let refused_before_a_reset = |lab: &mut ServiceUnderTest| {
        let before = truth(lab);
        let refused = lab.tactus(&["--json", "run", &presses, "--no-report"]);
        assert_eq!(refused.code, Some(4), "{refused:?}");
        assert!(refused.out.contains("nothing has been reset since the service started"), "{refused:?}");
        assert_eq!(truth(lab), before);
        let after = status(lab);
        assert_eq!(after["run"]["phase"], "idle");
        assert_eq!(after["fault"], "nothing has been reset since the service started");
    };
    refused_before_a_reset(&mut lab);
    assert_eq!(lab.tactus(&["reset"]).code, Some(0));
    assert_eq!(status(&lab)["fault"], Value::Null);
    let done = lab.tactus(&["--json", "run", &presses, "--no-report"]);
    assert_eq!(done.code, Some(0), "{done:?}");

    // The stage knows its position; even so the new service moves it only after a reset.
    lab.daemon.kill();
    lab.daemon = Process::start("tactusd", lab.folder.path(), &["--config", "tactusd.toml"]);
    lab.daemon.wait_for("ready");
    refused_before_a_reset(&mut lab);
}

#[test]
fn an_alarm_fails_the_run_and_only_an_explicit_reset_makes_the_stage_move_again() {
    let mut lab = ServiceUnderTest::start(|rig| rig);
    let script = lab.script("hold.star", HOLD);
    let client = lab.start_tactus(&["--json", "run", &script, "--no-report"]);
    wait_until_pressing(&lab);
    lab.mock.type_line("stage alarm 1");
    let (code, said) = client.wait();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("alarm 1"), "{said}");

    let presses = lab.script("presses.star", PRESSES);
    let refused = lab.tactus(&["--json", "run", &presses, "--no-report"]);
    assert_eq!(refused.code, Some(4), "{refused:?}");
    assert!(
        refused.out.contains("the stage is in alarm") && refused.out.contains("`tactus reset`"),
        "{refused:?}"
    );

    let reset = lab.tactus(&["--json", "reset"]);
    assert_eq!(reset.code, Some(0), "{reset:?}");
    assert_eq!(reset.json()["stage"]["status"], "idle");
    let done = lab.tactus(&["--json", "run", &presses, "--no-report"]);
    assert_eq!(done.code, Some(0), "{done:?}");
}

#[test]
fn a_stop_needs_no_sensor_no_name_and_no_free_connection() {
    let folder = tempfile::TempDir::new().unwrap();
    fs::copy(repository("config/rigs/pty.toml"), folder.path().join("rig.toml")).unwrap();
    let endpoint = free_endpoint();
    let config = format!("rig = \"rig.toml\"\nrecordings = \"runs\"\n[bus]\nlisten = [\"{endpoint}\"]\n");
    fs::write(folder.path().join("tactusd.toml"), config).unwrap();
    // Its devices do not exist, so it is never ready.
    let mut daemon = Process::start("tactusd", folder.path(), &["--config", "tactusd.toml"]);
    daemon.wait_for("tactusd starts");
    let address = endpoint.strip_prefix("tcp/").unwrap();
    let mut idle = Vec::new();
    while idle.len() < 900 {
        match TcpStream::connect(address) {
            Ok(socket) => idle.push(socket),
            // It listens a moment later.
            Err(error) if idle.is_empty() && error.kind() == std::io::ErrorKind::ConnectionRefused => {}
            Err(_) => break,
        }
    }
    assert!(idle.len() >= 200, "{}", idle.len());
    let said = tactus(folder.path(), &["--endpoint", &endpoint, "stop", "--reason", "smoke"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    daemon.wait_for("smoke");
}
