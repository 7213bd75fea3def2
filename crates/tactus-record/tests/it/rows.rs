//! Rows from recordings and tables.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::synthetic::{Plan, Run};
use tactus_record::{
    RowsError, export,
    rows::{self, Source},
};
use tactus_schema::table::Row;

fn plan(run_id: &str, presses: usize) -> Plan {
    Plan { run_id: run_id.into(), ..Plan::short(presses) }
}

fn recorded(dir: &Path, run: &Run) -> PathBuf {
    let path = dir.join(format!("{}.mcap", run.plan.run_id));
    run.record(&path).unwrap();
    path
}

fn exported(recording: &Path) -> PathBuf {
    let table = recording.with_extension("parquet");
    export(&[recording], &table).unwrap();
    table
}

fn visited(paths: &[&PathBuf]) -> (Source, Vec<Row>) {
    let mut rows = Vec::new();
    let source = rows::visit(paths, |_, row| rows.push(Row::from(row)));
    (source.unwrap(), rows)
}

fn refused(paths: &[&PathBuf]) -> (RowsError, usize) {
    let mut given = 0;
    let error = rows::visit(paths, |_, _| given += 1).unwrap_err();
    (error, given)
}

#[test]
fn a_recording_and_its_table_give_the_same_rows() {
    let dir = tempfile::tempdir().unwrap();
    let recording = recorded(dir.path(), &Plan { lost: vec![50, 51], ..plan("a", 3) }.make());
    let table = exported(&recording);
    let (of_recording, rows) = visited(&[&recording]);
    let (of_table, same) = visited(&[&table]);
    assert!(rows.len() > 100);
    assert_eq!(rows, same);
    assert_eq!(of_recording.rig, of_table.rig);
    for (source, path) in [(of_recording, recording), (of_table, table)] {
        let run = rows::RunSource { run: "a".into(), path, simulated: true };
        assert_eq!((source.runs, source.warnings), (vec![run], vec![]));
    }
}

#[test]
fn recordings_and_tables_mix_in_the_order_given_whatever_their_names() {
    let dir = tempfile::tempdir().unwrap();
    let table = exported(&recorded(dir.path(), &plan("a", 1).make()));
    let cut = recorded(dir.path(), &plan("b", 2).make());
    let bytes = fs::read(&cut).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let misnamed = dir.path().join("c.txt");
    fs::rename(recorded(dir.path(), &plan("c", 1).make()), &misnamed).unwrap();

    let files = [&misnamed, &table, &cut];
    let (source, rows) = visited(&files);
    let runs: Vec<_> = source.runs.iter().map(|run| (run.run.as_str(), &run.path)).collect();
    assert_eq!(runs, [("c", &misnamed), ("a", &table), ("b", &cut)]);
    assert_eq!(rows, files.map(|file| visited(&[file]).1).concat());
    let [warning] = &source.warnings[..] else { panic!("one warning: {:?}", source.warnings) };
    assert!(warning.starts_with("run b: the recording is readable up to byte"), "{warning}");
}

#[test]
fn what_does_not_go_together_is_refused_before_its_first_row() {
    let dir = tempfile::tempdir().unwrap();
    let recording = recorded(dir.path(), &plan("a", 1).make());
    let table = exported(&recording);
    let rows = visited(&[&recording]).1.len();

    for twice in [[&recording, &table], [&table, &recording], [&table, &table]] {
        let (error, given) = refused(&twice);
        assert!(matches!(&error, RowsError::RunTwice { run, .. } if run == "a"), "{error}");
        assert_eq!(given, rows);
    }

    let mut other = plan("b", 1).make();
    other.rig.registration.origin_mm[0] += 0.5;
    let other = exported(&recorded(dir.path(), &other));
    let (error, given) = refused(&[&recording, &other]);
    assert!(matches!(&error, RowsError::RigsDiffer { path, .. } if *path == other), "{error}");
    let groups = format!(
        "The files are of 2 rigs; give those of one rig at a time:\n  rig \"sim\": {}\n  rig \"sim\": {}",
        recording.display(),
        other.display()
    );
    let text = error.to_string();
    assert!(text.contains("registration.origin_mm is [20.5,15.0], not [20.0,15.0]. "), "{text}");
    assert!(text.ends_with(&groups), "{text}");
    assert_eq!(given, rows);
}

#[test]
fn runs_of_a_rig_that_was_calibrated_and_renamed_between_them_go_together() {
    let dir = tempfile::tempdir().unwrap();
    let first = recorded(dir.path(), &plan("a", 1).make());
    let mut later = plan("b", 1).make();
    later.rig.baseline_counts[5] += 1.0;
    later.rig.sensitivity_counts_per_mm[2] *= 1.02;
    later.rig.name = "monday".into();
    let later = exported(&recorded(dir.path(), &later));
    let (source, rows) = visited(&[&first, &later]);
    assert_eq!(rows, [&first, &later].map(|file| visited(&[file]).1).concat());
    let alone = visited(&[&first]).0;
    assert_eq!(source.rig, alone.rig, "as the first file describes it");
    assert_eq!(source.names, [alone.rig.name, "monday".into()]);
}

#[test]
fn what_holds_no_rows_is_refused_with_what_is_accepted() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("table.parquet");
    fs::write(&path, b"").unwrap();
    let text = refused(&[&path]).0.to_string();
    assert!(text.ends_with("table.parquet is empty: nothing was written to it"), "{text}");
    for bytes in [&b"PAR"[..], b"run,press\n"] {
        fs::write(&path, bytes).unwrap();
        let text = refused(&[&path]).0.to_string();
        assert!(text.contains("neither a recording (MCAP) nor a measurement table (Parquet)"), "{text}");
    }
    let (absent, _) = refused(&[&dir.path().join("absent")]);
    assert!(absent.to_string().starts_with("cannot open"), "{absent}");
    assert!(matches!(refused(&[]).0, RowsError::Nothing));
}
