use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use tactus_record::{Header, RecordError, Recording, Script, info};
use tactus_schema::pb::run_event::Event;
use tactus_schema::{Frame, Rig, WallTime, pb};

use super::close_all;

const RIG_TOML: &str = include_str!("../../../config/rigs/sim.toml");

fn begin(folder: &Path, run_id: &str) -> (PathBuf, Recording) {
    fs::create_dir(folder.join(run_id)).unwrap();
    let path = folder.join(run_id).join("recording.mcap");
    let header = Header {
        run_id,
        experiment: "corners",
        who: "ada",
        rig: &Rig::from_toml(RIG_TOML).unwrap(),
        rig_toml: Some(RIG_TOML),
        link_toml: None,
        script: Script { name: "corners.star", source: "" },
        versions: &BTreeMap::new(),
        parameters_json: "{}",
        started: WallTime::from_ns(1),
        simulated: true,
        continues: None,
    };
    let recording = Recording::create(&path, &header).unwrap();
    (path, recording)
}

/// Three presses, the third of which is under way, with the tip in contact.
fn fill(recording: &mut Recording, run_id: &str) {
    let mut events = Vec::new();
    for press in 0..3_i32 {
        let step = u64::try_from(press).unwrap();
        events.push(Event::StepStarted(pb::StepStarted { step, ..Default::default() }));
        events.push(Event::DwellDone(pb::DwellDone {
            press,
            x_mm: 5.0,
            y_mm: f64::from(press),
            depth_mm: 0.6,
            ..Default::default()
        }));
        if press < 2 {
            events.push(Event::StepDone(pb::StepDone { step, ..Default::default() }));
        }
    }
    for seq in 0..60_u64 {
        let t_mono_ns = i64::try_from(seq).unwrap() * 33_333_333;
        let (counts, t_wall_ns) = (vec![1.0; 48], t_mono_ns + 1);
        let frame: Frame = pb::Frame { seq, counts, t_mono_ns, t_wall_ns, ..Default::default() }.into();
        recording.write(&frame).unwrap();
        let z_mm = -0.01 * seq as f64;
        let status = pb::StageStatus::Moving.into();
        recording
            .write(&pb::StageState { seq, t_mono_ns, t_wall_ns, z_mm, status, ..Default::default() })
            .unwrap();
        if let Some(event) = usize::try_from(seq).ok().and_then(|seq| events.get(seq)) {
            let event = Some(event.clone());
            let run_id = run_id.to_owned();
            recording.write(&pb::RunEvent { seq, run_id, t_mono_ns, t_wall_ns, event }).unwrap();
        }
    }
    recording.flush().unwrap();
}

#[test]
fn a_run_whose_service_died_is_closed_once_with_where_the_tip_was() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mut recording) = begin(folder.path(), "r1");
    fill(&mut recording, "r1");
    drop(recording);
    let closed = close_all(folder.path());
    let [crashed] = closed.as_slice() else { panic!("{closed:?}") };
    assert_eq!((crashed.run_id.as_str(), crashed.frames, crashed.frames_missing), ("r1", 60, 0));
    assert_eq!((crashed.last_press.unwrap().press, crashed.last_press.unwrap().at_mm), (1, [5.0, 1.0]));
    assert!((crashed.tip_mm.unwrap()[2] + 0.59).abs() < 1e-9);
    assert_eq!(crashed.original, None);
    let info = info(&path).unwrap();
    assert_eq!((info.exit_status, info.frames), (Some("crashed"), 60));
    let told = &info.message;
    assert!(
        told.contains("press 1 at (5.000, 1.000) mm, 0.600 mm deep") && told.contains("z = -0.590 mm"),
        "{told}"
    );
    let whole = fs::read(&path).unwrap();
    assert!(close_all(folder.path()).is_empty(), "once");
    assert!(fs::read(&path).unwrap() == whole);
    let names: Vec<_> =
        fs::read_dir(path.parent().unwrap()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["recording.mcap"]);
}

#[test]
fn a_recording_that_a_process_writes_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mut recording) = begin(folder.path(), "r1");
    fill(&mut recording, "r1");
    let before = fs::read(&path).unwrap();
    assert!(close_all(folder.path()).is_empty());
    assert!(fs::read(&path).unwrap() == before);
    recording.finish().unwrap();
    assert!(close_all(folder.path()).is_empty(), "a recording that was closed");
}

#[test]
fn a_crashed_recording_that_is_damaged_too_is_kept_beside_its_closed_copy() {
    let folder = tempfile::tempdir().unwrap();
    let (path, mut recording) = begin(folder.path(), "r1");
    fill(&mut recording, "r1");
    drop(recording);
    let mut bytes = fs::read(&path).unwrap();
    let at = bytes.len() / 2;
    bytes[at] ^= 0xff;
    fs::write(&path, &bytes).unwrap();
    // An earlier closing was interrupted.
    fs::write(path.with_extension("closing"), "half").unwrap();
    let closed = close_all(folder.path());
    let [crashed] = closed.as_slice() else { panic!("{closed:?}") };
    assert!(fs::read(crashed.original.as_ref().unwrap()).unwrap() == bytes);
    assert_eq!(info(&path).unwrap().exit_status, Some("crashed"));
    assert!(close_all(folder.path()).is_empty());
}

#[test]
fn one_that_cannot_be_closed_does_not_keep_the_others_from_it() {
    let folder = tempfile::tempdir().unwrap();
    assert!(close_all(&folder.path().join("none")).is_empty(), "before the first run");
    fs::create_dir(folder.path().join("r0")).unwrap();
    fs::write(folder.path().join("r0/recording.mcap"), "no recording").unwrap();
    let (_, mut recording) = begin(folder.path(), "r1");
    fill(&mut recording, "r1");
    drop(recording);
    assert_eq!(close_all(folder.path()).len(), 1);
    assert!(matches!(info(folder.path().join("r0/recording.mcap")), Err(RecordError::NotMcap { .. })));
    assert_eq!(fs::read(folder.path().join("r0/recording.mcap")).unwrap(), b"no recording");
}
