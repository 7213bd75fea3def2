//! The measurement table of recordings whose truth is known.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::synthetic::{Fed, Plan, Run, TICK_NS};
use tactus_record::{
    Recording, RowsError, export, export_as,
    table::{self, Table, TableFormat},
};
use tactus_schema::{Rig, pb, table::Phase};

fn recorded(dir: &Path, plan: Plan) -> (Run, PathBuf) {
    let path = dir.join(format!("{}.mcap", plan.run_id));
    let run = plan.make();
    run.record(&path).unwrap();
    (run, path)
}

/// Records the run with every message changed.
fn recorded_as(run: &Run, path: &Path, mut change: impl FnMut(&mut Fed) -> bool) {
    let mut recording = run.with_header(|header| Recording::create(path, header)).unwrap();
    for fed in &run.fed {
        let mut fed = fed.clone();
        if change(&mut fed) {
            fed.write(&mut recording).unwrap();
        }
    }
    recording.finish().unwrap();
}

fn exported(dir: &Path, recordings: &[&PathBuf]) -> (tactus_record::ExportSummary, Table) {
    let out = dir.join("table.parquet");
    let summary = export(recordings, &out).unwrap();
    (summary, table::read(&out).unwrap())
}

#[test]
fn rows_are_the_frames_at_their_sampling_times() {
    let dir = tempfile::tempdir().unwrap();
    let (run, path) = recorded(dir.path(), Plan { lost: vec![50, 51], ..Plan::short(3) });
    let (summary, table) = exported(dir.path(), &[&path]);
    assert_eq!(summary.rows, run.frames().count() as u64);
    assert_eq!(summary.warnings, Vec::<String>::new());
    let clock = summary.clocks[0].epochs[0];
    assert_eq!(clock.tick_ns, TICK_NS);
    // The device floors its time to whole ticks; the least delay is 2 ms.
    for ((row, frame), sampled_s) in table.rows().zip(run.frames()).zip(&run.sampled_s) {
        assert_eq!(row.counts, &*frame.counts);
        let late_s = row.t_ns as f64 * 1e-9 - sampled_s;
        assert!((0.001..0.003).contains(&late_s), "{late_s}");
        assert!(late_s <= 0.002 + clock.uncertainty_ns as f64 * 1e-9);
    }
    assert!(table.t_ns().windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn positions_and_phases_are_the_stages_at_the_sampling_time() {
    let dir = tempfile::tempdir().unwrap();
    let (run, path) = recorded(dir.path(), Plan::short(3));
    let (_, table) = exported(dir.path(), &[&path]);
    let mut phases = Vec::new();
    for row in table.rows() {
        let truth_mm = run.position_mm(row.t_ns as f64 * 1e-9);
        for axis in 0..3 {
            // The synthetic stage reports at every bend of its path, so straight lines between the reports are exact.
            assert!((row.position_mm[axis] - truth_mm[axis]).abs() < 1e-6, "{row:?} {truth_mm:?}");
        }
        match row.phase {
            Phase::Idle => assert_eq!(row.press, -1),
            Phase::Hold => assert!(row.press >= 0 && row.position_mm[2] < -0.19),
            Phase::Load => assert!(row.position_mm[2] <= 0.0),
            Phase::Approach | Phase::Unload | Phase::Retract => assert!(row.press >= 0),
        }
        if phases.last() != Some(&(row.press, row.phase)) {
            phases.push((row.press, row.phase));
        }
        assert_eq!((row.run, row.indenter, row.covering_mm), (run.plan.run_id.as_str(), "cyl1", 1.016));
    }
    let second: Vec<Phase> =
        phases.iter().filter(|(press, _)| *press == 1).map(|(_, phase)| *phase).collect();
    assert_eq!(second[..4], [Phase::Approach, Phase::Load, Phase::Hold, Phase::Load]);
    assert_eq!(second[second.len() - 2..], [Phase::Unload, Phase::Retract]);
}

#[test]
fn a_drifting_device_clock_is_followed() {
    let dir = tempfile::tempdir().unwrap();
    let plan = Plan { drift_ppm: 120.0, idle_s: 200.0, ..Plan::short(2) };
    let (run, path) = recorded(dir.path(), plan);
    let (summary, table) = exported(dir.path(), &[&path]);
    let clock = summary.clocks[0].epochs[0];
    assert!((clock.drift_ppm - 120.0).abs() < 10.0, "{}", clock.drift_ppm);
    // 120 ppm of 200 s are 24 ms, nearly a frame.
    for (row, sampled_s) in table.rows().zip(&run.sampled_s) {
        let late_s = row.t_ns as f64 * 1e-9 - sampled_s;
        assert!((0.0..0.004).contains(&late_s), "{late_s}");
    }
}

#[test]
fn the_clock_and_the_rig_stand_in_the_metadata() {
    let dir = tempfile::tempdir().unwrap();
    let (run, path) = recorded(dir.path(), Plan::short(1));
    let (_, table) = exported(dir.path(), &[&path]);
    let metadata = &table.head().metadata;
    assert_eq!(Rig::from_json(&metadata["tactus.rig"]).unwrap().array, run.rig.array);
    let clock: serde_json::Value = serde_json::from_str(&metadata["tactus.clock"]).unwrap();
    assert_eq!(clock["schema"], "tactus.clock/1");
    assert_eq!(clock["runs"][0]["run"], run.plan.run_id.as_str());
    let epoch = &clock["runs"][0]["epochs"][0];
    assert_eq!(epoch["tick_ns"], TICK_NS);
    assert!(epoch["offset_ns"].as_i64().unwrap() < 0 && epoch["uncertainty_ns"].as_i64().unwrap() > 0);
}

#[test]
fn frames_without_a_device_clock_are_dated_by_their_arrival_and_said_so() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan::short(1).make();
    let path = dir.path().join("run.mcap");
    recorded_as(&run, &path, |fed| {
        if let Fed::Frame(frame) = fed {
            frame.device_tick = None;
        }
        true
    });
    let (summary, table) = exported(dir.path(), &[&path]);
    let arrived: Vec<i64> = run.frames().map(|frame| frame.received.mono.ns()).collect();
    assert_eq!(table.t_ns(), arrived);
    assert!(summary.warnings.iter().any(|warning| warning.contains("no clock")), "{:?}", summary.warnings);
}

#[test]
fn elements_that_were_not_read_are_said() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan::short(1).make();
    let path = dir.path().join("run.mcap");
    let mut frames = 0;
    recorded_as(&run, &path, |fed| {
        if let Fed::Frame(frame) = fed {
            frames += 1;
            match frames {
                3 => frame.bad_elements = [7, 11].into(),
                4 => frame.bad_elements = [7].into(),
                _ => {}
            }
        }
        true
    });
    let (summary, _) = exported(dir.path(), &[&path]);
    let told = "in 2 frames elements were not read and stand with an earlier reading: 7, 11";
    assert!(summary.warnings.iter().any(|warning| warning.ends_with(told)), "{:?}", summary.warnings);
}

#[test]
fn the_temperature_that_a_sensor_tells_is_in_the_table() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan::short(1).make();
    let path = dir.path().join("run.mcap");
    let told = |seq: u64| (!seq.is_multiple_of(3)).then_some(20.0 + seq as f32 / 64.0);
    recorded_as(&run, &path, |fed| {
        if let Fed::Frame(frame) = fed {
            frame.temperature_c = told(frame.seq);
        }
        true
    });
    let (_, table) = exported(dir.path(), &[&path]);
    let recorded: Vec<_> = table.rows().map(|row| row.temperature_c).collect();
    let made: Vec<_> = run.frames().map(|frame| told(frame.seq).map(f64::from)).collect();
    assert_eq!(recorded, made);
}

#[test]
fn the_device_clock_begins_anew_with_each_connection() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan::short(2).make();
    let half = run.frames().count() as u64 / 2;
    let path = dir.path().join("run.mcap");
    recorded_as(&run, &path, |fed| {
        if let Fed::Frame(frame) = fed
            && frame.seq > half
        {
            frame.epoch = 1;
            frame.device_tick = frame.device_tick.map(|tick| tactus_schema::DeviceTick(tick.0 - 3000));
        }
        true
    });
    let (summary, table) = exported(dir.path(), &[&path]);
    let [before, after] = summary.clocks[0].epochs.as_slice() else { panic!("{:?}", summary.clocks) };
    assert!((after.offset_ns - before.offset_ns - 3_000_000_000).abs() < 2_000_000);
    for (row, sampled_s) in table.rows().zip(&run.sampled_s) {
        assert!((0.001..0.004).contains(&(row.t_ns as f64 * 1e-9 - sampled_s)));
    }
}

#[test]
fn repeated_ticks_are_told_apart_and_counted() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan::short(1).make();
    let path = dir.path().join("run.mcap");
    let mut last = None;
    recorded_as(&run, &path, |fed| {
        if let Fed::Frame(frame) = fed {
            if frame.seq == 30 {
                frame.device_tick = last;
            }
            last = frame.device_tick;
        }
        true
    });
    let (summary, table) = exported(dir.path(), &[&path]);
    assert_eq!(table.t_ns()[30], table.t_ns()[29] + 1);
    assert!(summary.warnings.iter().any(|warning| warning.contains("1 frames did not come after")));
}

#[test]
fn outside_the_stages_reports_the_nearest_one_counts() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan::short(1).make();
    let path = dir.path().join("run.mcap");
    // Reports between 3 s and 4 s only.
    let mut last = None;
    recorded_as(&run, &path, |fed| {
        let Fed::Stage(state) = fed else { return true };
        let kept = (3_000_000_000..4_000_000_000).contains(&state.t_mono_ns);
        if kept {
            last = Some([state.x_mm, state.y_mm, state.z_mm]);
        }
        kept
    });
    let (_, table) = exported(dir.path(), &[&path]);
    let positions: Vec<_> = table.rows().map(|row| Some(row.position_mm)).collect();
    assert_eq!(positions[0], Some(run.position_mm(3.0)));
    assert_eq!(positions[positions.len() - 1], last);
}

#[test]
fn a_change_of_the_covering_stands_in_the_rows_after_it() {
    let dir = tempfile::tempdir().unwrap();
    let mut run = Plan::short(1).make();
    let at = run.fed.iter().position(|fed| matches!(fed, Fed::Frame(frame) if frame.seq == 60)).unwrap();
    let Fed::Frame(frame) = run.fed[at].clone() else { panic!() };
    let changed = pb::RunEvent {
        t_mono_ns: frame.received.mono.ns(),
        event: Some(pb::run_event::Event::CoveringChanged(pb::CoveringChanged { covering_mm: 2.54 })),
        ..pb::RunEvent::default()
    };
    run.fed.insert(at + 1, Fed::Event(changed));
    let path = dir.path().join("run.mcap");
    run.record(&path).unwrap();
    let (_, table) = exported(dir.path(), &[&path]);
    let coverings: Vec<f64> = table.rows().map(|row| row.covering_mm).collect();
    assert_eq!((coverings[60], coverings[61]), (1.016, 2.54));
}

#[test]
fn runs_follow_each_other_in_one_table() {
    let dir = tempfile::tempdir().unwrap();
    let (_, first) = recorded(dir.path(), Plan { run_id: "first".into(), ..Plan::short(1) });
    let (_, second) = recorded(dir.path(), Plan { run_id: "second".into(), seed: 8, ..Plan::short(2) });
    let (summary, table) = exported(dir.path(), &[&first, &second]);
    assert_eq!(summary.runs, 2);
    let runs: Vec<&str> = table.runs().iter().map(|run| &*run.run).collect();
    assert_eq!(runs, ["first", "second"]);

    let out = dir.path().join("twice.parquet");
    let twice = export(&[&first, &first], &out).unwrap_err();
    assert!(matches!(&twice, RowsError::RunTwice { run, .. } if run == "first"), "{twice}");
    assert!(!out.exists() && fs::read_dir(dir.path()).unwrap().count() == 3, "nothing is left behind");
}

#[test]
fn runs_on_different_rigs_do_not_mix() {
    let dir = tempfile::tempdir().unwrap();
    let (_, first) = recorded(dir.path(), Plan { run_id: "first".into(), ..Plan::short(1) });
    let mut other = Plan { run_id: "second".into(), ..Plan::short(1) }.make();
    other.rig.baseline_counts[5] += 1.0;
    let second = dir.path().join("second.mcap");
    other.record(&second).unwrap();
    let error = export(&[&first, &second], dir.path().join("out.parquet")).unwrap_err();
    assert!(matches!(error, RowsError::RigsDiffer { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains(": baseline_counts is ") && text.contains("of 2 rigs"), "{text}");
}

#[test]
fn a_recording_without_positions_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan::short(1).make();
    let path = dir.path().join("run.mcap");
    recorded_as(&run, &path, |fed| {
        if let Fed::Stage(state) = fed {
            state.status = pb::StageStatus::Disconnected.into();
        }
        true
    });
    let error = export(&[&path], dir.path().join("out.parquet")).unwrap_err();
    assert!(matches!(error, RowsError::NoStage { .. }), "{error}");
    assert!(matches!(export::<PathBuf>(&[], dir.path().join("out.parquet")), Err(RowsError::Nothing)));
}

#[test]
fn a_frame_of_another_array_is_refused_with_its_row() {
    let dir = tempfile::tempdir().unwrap();
    let run = Plan::short(1).make();
    let path = dir.path().join("run.mcap");
    recorded_as(&run, &path, |fed| {
        if let Fed::Frame(frame) = fed
            && frame.seq == 17
        {
            frame.counts = frame.counts[..47].into();
        }
        true
    });
    let error = export(&[&path], dir.path().join("out.parquet")).unwrap_err();
    let RowsError::Table(error) = error else { panic!("{error}") };
    assert_eq!((error.row(), error.column()), (Some(17), Some("counts")));
}

#[test]
fn a_cut_recording_gives_what_is_there_with_a_warning() {
    let dir = tempfile::tempdir().unwrap();
    let (run, path) = recorded(dir.path(), Plan::short(2));
    let bytes = fs::read(&path).unwrap();
    // In a chunk in the middle, however long the rest of the file is.
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let cut = usize::try_from(chunks[chunks.len() / 2].chunk_start_offset).unwrap() + 100;
    fs::write(&path, &bytes[..cut]).unwrap();
    let (summary, table) = exported(dir.path(), &[&path]);
    assert!(!table.is_empty() && table.len() < run.frames().count());
    assert!(summary.warnings[0].contains("readable up to byte"), "{:?}", summary.warnings);
}

#[test]
fn a_table_is_text_or_arrays_too() {
    let dir = tempfile::tempdir().unwrap();
    let (run, path) = recorded(dir.path(), Plan::short(2));
    let (_, table) = exported(dir.path(), &[&path]);
    let rows: Vec<_> = table.rows().collect();

    let out = dir.path().join("table.csv");
    assert_eq!(TableFormat::of_path(&out), Some(TableFormat::Csv));
    let summary = export_as(&[&path], &out, TableFormat::Csv).unwrap();
    assert_eq!(summary.rows, rows.len() as u64);
    let text = fs::read_to_string(&out).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    assert_eq!((header.len(), header[0], header[10], header[57]), (58, "run", "counts_0", "counts_47"));
    let lines: Vec<_> = lines.collect();
    assert_eq!(lines.len(), rows.len());
    for (line, row) in lines.iter().zip(&rows) {
        let count = |element: usize| line[10 + element].parse::<f32>().unwrap();
        assert_eq!((line[0], line[2], line[9]), (row.run, row.phase.name(), ""));
        assert_eq!((line[3].parse(), line[6].parse()), (Ok(row.t_ns), Ok(row.position_mm[2])));
        assert_eq!(
            [count(0), count(47)].map(f32::to_bits),
            [row.counts[0], row.counts[47]].map(f32::to_bits)
        );
    }
    let beside = fs::read_to_string(dir.path().join("table.metadata.json")).unwrap();
    let beside: serde_json::Value = serde_json::from_str(&beside).unwrap();
    assert_eq!(
        (&beside["tactus.rig"]["name"], &beside["tactus.clock"]["schema"]),
        (&run.rig.name.clone().into(), &"tactus.clock/1".into())
    );

    let out = dir.path().join("table.npz");
    export_as(&[&path], &out, TableFormat::Npz).unwrap();
    let bytes = fs::read(&out).unwrap();
    let counts: Vec<u8> =
        rows.iter().flat_map(|row| row.counts.iter().flat_map(|count| count.to_le_bytes())).collect();
    let holds = |part: &[u8]| bytes.windows(part.len()).any(|window| window == part);
    assert!(bytes.starts_with(b"PK\x03\x04") && holds(b"counts.npy\x93NUMPY\x01\x00"));
    assert!(holds(format!("'shape': ({}, 48), }}", rows.len()).as_bytes()) && holds(&counts));
    // No `.part` is left.
    let left = fs::read_dir(dir.path())
        .unwrap()
        .filter(|file| file.as_ref().unwrap().path().extension().is_some_and(|e| e == "part"));
    assert_eq!(left.count(), 0);
}
