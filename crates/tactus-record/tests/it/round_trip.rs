//! What is recorded is read back, message for message.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use crate::synthetic::{Fed, Plan, RIG_TOML, SCRIPT, STARTED_NS};
use tactus_record::{Completeness, Entry, Message, RecordError, Recording, Tally, info, read, tail};
use tactus_schema::{Rig, WallTime, pb};

#[test]
fn every_message_comes_back_in_order() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    let run = Plan { lost: vec![40, 41, 100], ..Plan::short(2) }.make();
    run.record(&path).unwrap();

    let mut reader = read(&path).unwrap();
    let entries: Vec<Entry> = reader.by_ref().map(Result::unwrap).collect();
    assert_eq!(reader.completeness(), Some(&Completeness::Complete));
    let messages: Vec<(&str, WallTime, &Message)> = entries
        .iter()
        .filter_map(|entry| match entry {
            Entry::Message { topic, at, message } => Some((&**topic, *at, message)),
            Entry::Run(_) | Entry::Attachment(_) => None,
        })
        .collect();
    assert_eq!(messages.len(), run.fed.len());
    for ((topic, at, message), fed) in messages.into_iter().zip(&run.fed) {
        let (expected_topic, expected_at, expected) = match fed {
            Fed::Info(info, at) => ("tactus/sim/sensor/info", at.wall, Message::SensorInfo(info.clone())),
            Fed::Frame(frame) => {
                ("tactus/sim/sensor/frame", frame.received.wall, Message::Frame(frame.clone()))
            }
            Fed::Stage(state) => {
                ("tactus/sim/stage/state", WallTime::from_ns(state.t_wall_ns), Message::Stage(*state))
            }
            Fed::Event(event) => {
                let at = WallTime::from_ns(event.t_wall_ns);
                ("tactus/sim/run/event", at, Message::Event(Box::new(event.clone())))
            }
        };
        assert_eq!((topic, at, message), (expected_topic, expected_at, &expected));
    }
}

#[test]
fn the_end_of_a_recording_whole_or_cut_off_has_its_last_messages() {
    let dir = tempfile::tempdir().unwrap();
    let whole = dir.path().join("run.mcap");
    Plan::short(4).make().record(&whole).unwrap();
    let bytes = fs::read(&whole).unwrap();
    let cut = dir.path().join("cut.mcap");
    // The index with the schemas takes more than a half.
    fs::write(&cut, &bytes[..bytes.len() / 4]).unwrap();
    for path in [whole, cut] {
        let all: Vec<Entry> = read(&path).unwrap().map(Result::unwrap).collect();
        let is_message = |entry: &&Entry| matches!(entry, Entry::Message { .. });
        let all_messages = all.iter().filter(is_message).count();
        for bytes in [24 << 10, 32 << 10, 1 << 30] {
            let end: Vec<Entry> = tail::entries(&path, bytes).unwrap().map(Result::unwrap).collect();
            assert_eq!(end[0], all[0], "it says which run it is");
            let messages: Vec<_> = end.iter().filter(is_message).collect();
            assert!(messages.iter().rev().zip(all.iter().rev()).all(|(end, all)| *end == all));
            let is_frame =
                |entry: &&Entry| matches!(entry, Entry::Message { message: Message::Frame(_), .. });
            assert!(
                end.iter().any(|entry| is_frame(&entry)),
                "{path:?} {bytes} {} of {all_messages}",
                messages.len()
            );
            assert_eq!(
                messages.len() == all_messages,
                bytes == 1 << 30,
                "{} of {all_messages}",
                messages.len()
            );
        }
    }
}

#[test]
fn the_header_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    let run = Plan::short(1).make();
    run.record(&path).unwrap();
    let entries: Vec<Entry> = read(&path).unwrap().map(Result::unwrap).collect();
    let Entry::Run(metadata) = &entries[0] else { panic!("{:?}", entries[0]) };
    assert_eq!(metadata.run_id, run.plan.run_id);
    assert_eq!((metadata.experiment.as_str(), metadata.who.as_str()), ("element-centres", "ada"));
    assert_eq!((metadata.rig.as_str(), metadata.simulated), ("sim", true));
    assert_eq!(metadata.started, WallTime::from_ns(STARTED_NS));
    let text = |name: &str| {
        let found = entries.iter().find_map(|entry| match entry {
            Entry::Attachment(file) => (file.name == name).then(|| file.data.clone()),
            Entry::Run(_) | Entry::Message { .. } => None,
        });
        String::from_utf8(found.unwrap()).unwrap()
    };
    assert_eq!(text("rig.toml"), RIG_TOML);
    assert_eq!(text("element-centres.star"), SCRIPT);
    assert_eq!(text("parameters.json"), r#"{"dwell_s":0.25}"#);
    let rig = Rig::from_json(&text("rig.json")).unwrap();
    assert_eq!((rig.name, rig.array), (run.rig.name, run.rig.array));
    assert!(text("versions.json").contains(r#""tactus":"0.1.0""#));
}

#[test]
fn summary_and_info_agree_with_what_happened() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    let run = Plan { lost: vec![40, 41, 100], ..Plan::short(3) }.make();
    let summary = run.record(&path).unwrap();
    let frames = run.frames().count() as u64;
    assert_eq!((summary.frames, summary.frames_lost, summary.gaps), (frames, 3, 2));
    assert_eq!((summary.presses, summary.dwells), (3, 15));
    assert_eq!(summary.exit_status, Some(pb::ExitStatus::Done));
    assert_eq!(summary.bytes, fs::metadata(&path).unwrap().len());

    let info = info(&path).unwrap();
    assert_eq!((info.frames, info.frames_lost, info.gaps), (frames, 3, 2));
    assert_eq!((info.presses, info.dwells, info.exit_status), (3, 15, Some("done")));
    assert_eq!(info.topics["tactus/sim/sensor/frame"], frames);
    assert_eq!(info.topics.values().sum::<u64>(), run.fed.len() as u64);
    assert_eq!(info.started, "2026-03-25T10:00:00Z");
    assert_eq!(info.versions["tactus"], "0.1.0");
    assert_eq!(info.attachments.len(), 5);
    assert!((info.duration_s - summary.duration_s).abs() < 1e-9);
    let text = info.to_string();
    assert!(text.contains("(SIMULATED)") && text.contains("exit status  done"), "{text}");
    let json: serde_json::Value = serde_json::from_str(&serde_json::to_string(&info).unwrap()).unwrap();
    assert_eq!(json["completeness"]["state"], "complete");
}

#[test]
fn a_run_that_was_not_closed_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    Plan { exit_status: None, ..Plan::short(1) }.make().record(&path).unwrap();
    let info = info(&path).unwrap();
    assert_eq!(info.exit_status, None);
    assert!(info.to_string().contains("open (never closed)"));
}

#[test]
fn an_existing_file_is_never_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    fs::write(&path, "precious").unwrap();
    let run = Plan::short(1).make();
    let error = run.with_header(|header| Recording::create(&path, header)).unwrap_err();
    assert!(matches!(error, RecordError::Io { action: "create", .. }), "{error}");
    assert_eq!(fs::read(&path).unwrap(), b"precious");
}

#[test]
fn what_is_no_recording_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("file");
    assert!(matches!(info(&path), Err(RecordError::Io { action: "open", .. })));
    for bytes in [&b""[..], b"\x89MCA", b"PAR1....", &[0; 100]] {
        fs::write(&path, bytes).unwrap();
        assert!(matches!(info(&path), Err(RecordError::NotMcap { .. })), "{bytes:?}");
    }
    let mut other = mcap::Writer::new(std::io::Cursor::new(Vec::new())).unwrap();
    other.finish().unwrap();
    fs::write(&path, other.into_inner().into_inner()).unwrap();
    assert!(matches!(info(&path), Err(RecordError::NoRun { .. })));
}

#[test]
fn two_recordings_of_one_run_are_identical() {
    let dir = tempfile::tempdir().unwrap();
    let paths = [dir.path().join("a.mcap"), dir.path().join("b.mcap")];
    for path in &paths {
        Plan::short(2).make().record(path).unwrap();
    }
    assert!(fs::read(&paths[0]).unwrap() == fs::read(&paths[1]).unwrap());
}

#[test]
fn the_tally_of_what_is_read_is_the_tally_of_what_was_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("run.mcap");
    let run = Plan { lost: vec![10], ..Plan::short(1) }.make();
    let summary = run.record(&path).unwrap();
    let mut tally = Tally::default();
    for entry in read(&path).unwrap() {
        if let Entry::Message { message, .. } = entry.unwrap() {
            tally.take(&message);
        }
    }
    assert_eq!((tally.frames(), tally.frames_lost()), (summary.frames, summary.frames_lost));
}
