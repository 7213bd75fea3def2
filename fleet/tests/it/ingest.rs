//! From recordings to one file per run: where it lies, what it says, what a kill leaves.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::{
    fs::{self, Permissions},
    num::NonZeroUsize,
    os::unix::fs::{PermissionsExt as _, symlink},
    path::Path,
    sync::Arc,
    thread,
};

use object_store::{ObjectStoreExt as _, memory::InMemory};
use serde_json::Value;
use tactus_fleet::{IngestOptions, Place, ingest};
use tactus_record::table;
use url::Url;

use crate::lab::{Lab, NOON_NS};

#[test]
fn each_run_is_a_file_by_rig_and_date_and_a_measurement_table() {
    let lab = Lab::with_three_runs();
    let told = lab.ingest();
    assert_eq!((&told["schema"], &told["runs_written"]), (&"tactus.fleet.ingest/1".into(), &3.into()));
    assert_eq!(
        lab.files(),
        [
            "rig=left/date=2026-03-25/20260325-120000-image.parquet",
            "rig=right/date=2026-03-25/20260325-120000-centres.parquet",
            "rig=right/date=2026-03-26/20260326-120000-centres.parquet",
        ]
    );
    let mut rows = 0;
    for file in lab.files() {
        let table = table::read(lab.path("fleet").join(&file)).unwrap();
        assert!(file.contains(&format!("rig={}/", table.head().rig.name)), "{file}");
        rows += table.len() as u64;
    }
    assert_eq!(told["rows"], rows);
    // The rows are those of the recording.
    let recording = lab.path("runs/20260325-120000-image/recording.mcap");
    tactus_record::export(&[recording], lab.path("table.parquet")).unwrap();
    let exported = table::read(lab.path("table.parquet")).unwrap();
    let ingested = table::read(lab.path("fleet").join(&lab.files()[0])).unwrap();
    assert!(exported.rows().eq(ingested.rows()));
}

#[test]
fn a_run_that_is_there_is_kept_and_a_recording_of_another_size_is_read_anew() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let before = lab.files().iter().map(|file| modified(&lab, file)).collect::<Vec<_>>();
    let told = lab.ingest();
    assert_eq!((&told["runs_written"], &told["runs_kept"]), (&0.into(), &3.into()));
    assert_eq!(before, lab.files().iter().map(|file| modified(&lab, file)).collect::<Vec<_>>());

    fs::remove_dir_all(lab.path("runs/20260325-120000-image")).unwrap();
    lab.record("left", "20260325-120000-image", NOON_NS, 3);
    let told = lab.ingest();
    assert_eq!((&told["runs_written"], &told["runs_kept"]), (&1.into(), &2.into()));
    let table = table::read(lab.path("fleet").join(&lab.files()[0])).unwrap();
    assert_eq!(table.rows().map(|row| row.press).max(), Some(2));
}

fn modified(lab: &Lab, file: &str) -> std::time::SystemTime {
    fs::metadata(lab.path("fleet").join(file)).unwrap().modified().unwrap()
}

#[test]
fn a_corrected_table_of_the_same_size_is_read_anew() {
    let lab = Lab::with_three_runs();
    lab.export(&[lab.path("runs/20260325-120000-image/recording.mcap")], "table.parquet");
    let ingest = || lab.fleet(&["--json", "ingest", "table.parquet", "--to", "fleet"]).json();
    let baseline_counts = || {
        let table = table::read(lab.path("fleet").join(&lab.files()[0])).unwrap();
        table.head().rig.baseline_counts.clone()
    };
    assert_eq!(ingest()["runs_written"], 1);
    let before = baseline_counts();
    assert_eq!(ingest()["runs_kept"], 1);

    let mut rig = table::read(lab.path("table.parquet")).unwrap().head().rig.clone();
    let old = rig.to_json();
    for counts in &mut rig.baseline_counts {
        *counts += 1.0;
    }
    replace(&lab.path("table.parquet"), &old, &rig.to_json());
    assert_eq!(ingest()["runs_written"], 1);
    assert_ne!(baseline_counts(), before);
}

/// Replaces a text of a file by another one of the same length.
fn replace(path: &Path, old: &str, new: &str) {
    assert_eq!(old.len(), new.len());
    let mut bytes = fs::read(path).unwrap();
    let at = bytes.windows(old.len()).position(|window| window == old.as_bytes()).unwrap();
    bytes[at..at + old.len()].copy_from_slice(new.as_bytes());
    fs::write(path, bytes).unwrap();
}

#[test]
fn a_file_that_is_no_longer_readable_is_written_again() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let file = lab.path("fleet").join(&lab.files()[1]);
    let whole = fs::read(&file).unwrap();
    fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    assert_eq!(lab.ingest()["runs_written"], 1);
    assert_eq!(fs::read(&file).unwrap(), whole);
}

#[test]
fn a_killed_ingest_leaves_whole_files_only_and_the_next_goes_on() {
    let lab = Lab::new();
    for run in 0..24 {
        lab.record("left", &format!("20260325-1200{run:02}-image"), NOON_NS, 4);
    }
    let mut child = lab.command(&["--threads", "1", "ingest", "runs", "--to", "fleet"]).spawn().unwrap();
    while lab.files().is_empty() && child.try_wait().unwrap().is_none() {
        thread::yield_now();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let whole = lab.files().into_iter().filter(|file| file.ends_with(".parquet")).collect::<Vec<_>>();
    for file in &whole {
        table::validate(lab.path("fleet").join(file)).unwrap();
    }
    let told = lab.ingest();
    assert_eq!(told["runs_kept"].as_u64(), Some(whole.len() as u64));
    let files = lab.files().into_iter().filter(|file| file.ends_with(".parquet"));
    assert_eq!(files.count(), 24);
}

#[test]
fn files_that_cannot_be_ingested_stop_no_other() {
    let lab = Lab::with_three_runs();
    let recording = lab.path("runs/20260325-120000-image/recording.mcap");
    fs::copy(&recording, lab.path("runs/copy.mcap")).unwrap();
    fs::write(lab.path("runs/other.mcap"), b"no recording").unwrap();
    let said = lab.fleet(&["--json", "ingest", "runs", "--to", "fleet"]);
    assert_eq!(said.code, Some(3), "{said:?}");
    let told = said.json();
    assert_eq!(told["runs_written"], 3);
    let failed = told["failed"].as_array().unwrap();
    assert_eq!(failed.len(), 2, "{told}");
    assert!(failed[0]["problem"].as_str().unwrap().contains("which was ingested"), "{told}");
    assert!(failed[1]["problem"].as_str().unwrap().contains("neither a recording"), "{told}");

    let said = lab.fleet(&["ingest", "nowhere", "--to", "fleet"]);
    assert_eq!(said.code, Some(1));
    assert!(said.err.contains("nowhere"), "{said:?}");
}

#[test]
fn linked_folders_are_searched_once() {
    let lab = Lab::with_three_runs();
    fs::rename(lab.path("runs"), lab.path("disk")).unwrap();
    fs::create_dir(lab.path("runs")).unwrap();
    symlink(lab.path("disk"), lab.path("runs/disk")).unwrap();
    symlink(lab.path("disk"), lab.path("runs/again")).unwrap();
    symlink(lab.path("runs"), lab.path("disk/back")).unwrap();
    let recording = "20260325-120000-image/recording.mcap";
    symlink(lab.path("disk").join(recording), lab.path("runs/one.mcap")).unwrap();
    assert_eq!(lab.ingest()["runs_written"], 3);
}

#[test]
fn folders_that_cannot_be_read_stop_nothing() {
    let lab = Lab::with_three_runs();
    symlink("loop", lab.path("runs/loop")).unwrap();
    let closed = lab.path("runs/closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, Permissions::from_mode(0o000)).unwrap();
    // Root reads it all the same.
    let is_closed = fs::read_dir(&closed).is_err();
    let said = lab.fleet(&["--json", "ingest", "runs", "--to", "fleet"]);
    fs::set_permissions(&closed, Permissions::from_mode(0o755)).unwrap();
    assert_eq!(said.code, Some(3), "{said:?}");
    let told = said.json();
    let paths: Vec<String> = failed(&told).into_iter().map(|(path, _)| path).collect();
    assert_eq!((&told["runs_written"], paths.len()), (&3.into(), 1 + usize::from(is_closed)), "{told}");
    assert_eq!(paths.last().map(String::as_str), Some("runs/loop"));
    assert!(!is_closed || paths[0] == "runs/closed", "{told}");
}

#[test]
fn a_table_is_ingested_run_by_run_and_needs_a_date_if_its_runs_have_none() {
    let lab = Lab::with_three_runs();
    let recordings = ["20260325-120000-centres", "20260326-120000-centres"]
        .map(|run| lab.path(&format!("runs/{run}/recording.mcap")));
    tactus_record::export(&recordings, lab.path("table.parquet")).unwrap();
    let said = lab.fleet(&["--json", "ingest", "table.parquet", "--to", "fleet"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(said.json()["runs_written"], 2);
    assert_eq!(lab.files().len(), 2);

    let undated = lab.record("left", "image of monday", NOON_NS, 1);
    tactus_record::export(&[undated], lab.path("undated.parquet")).unwrap();
    let said = lab.fleet(&["ingest", "undated.parquet", "--to", "fleet"]);
    assert_eq!(said.code, Some(3), "{said:?}");
    assert!(said.out.contains("Give one with --date"), "{said:?}");
    let said = lab.fleet(&["ingest", "undated.parquet", "--to", "fleet", "--date", "2026-03-30"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(
        lab.files().contains(&"rig=left/date=2026-03-30/image of monday.parquet".to_owned()),
        "{:?}",
        lab.files()
    );
}

/// Two tables, each with a run `press` of one rig, but not the same one.
fn two_tables_of_one_run() -> Lab {
    let lab = Lab::new();
    for (table, presses) in [("mon/press.parquet", 1), ("tue/press.parquet", 2)] {
        let recording = lab.record("left", "press", NOON_NS, presses);
        lab.export(&[recording], table);
        fs::remove_dir_all(lab.path("runs")).unwrap();
    }
    lab
}

/// Problems of files that were not ingested, or of runs of them, in order of their paths.
fn failed(told: &Value) -> Vec<(String, String)> {
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let failed = told["failed"].as_array().unwrap();
    failed.iter().map(|failed| (text(&failed["path"]), text(&failed["problem"]))).collect()
}

#[test]
fn of_two_tables_with_one_run_one_gives_it_and_the_other_is_named() {
    let lab = two_tables_of_one_run();
    let tables = ["mon/press.parquet", "tue/press.parquet"];
    let args = ["--json", "ingest", tables[0], tables[1], "--to", "fleet", "--date", "2026-03-30"];
    let said = lab.fleet(&args);
    assert_eq!(said.code, Some(3), "{said:?}");
    let told = said.json();
    assert_eq!(told["runs_written"], 1);
    let failed = failed(&told);
    let [(path, problem)] = failed.as_slice() else { panic!("{failed:?}") };
    let first = tables.into_iter().find(|table| table != path).unwrap();
    assert!(problem.contains("\"press\" of rig left") && problem.contains(first), "{problem}");
    let given = table::read(lab.path(first)).unwrap();
    let written = table::read(lab.path("fleet").join(&lab.files()[0])).unwrap();
    assert!(written.rows().eq(given.rows()));
}

#[test]
fn the_other_runs_of_a_table_are_ingested() {
    let lab = two_tables_of_one_run();
    let [monday, other] = ["press", "other"].map(|run| lab.record("left", run, NOON_NS, 1));
    lab.export(&[monday, other], "both.parquet");
    fs::remove_dir_all(lab.path("mon")).unwrap();
    let args = ["both.parquet", "tue/press.parquet", "--to", "fleet", "--date", "2026-03-30"];
    let told = lab.fleet(&[&["--json", "ingest"][..], &args].concat()).json();
    assert_eq!((&told["runs_written"], failed(&told).len()), (&2.into(), 1), "{told}");
    assert_eq!(lab.files().len(), 2);
}

#[test]
fn a_recording_is_replaced_by_no_table_of_its_run() {
    let lab = Lab::new();
    let run = "20260325-120000-image";
    let recording = lab.record("left", run, NOON_NS, 1);
    lab.export(&[recording], "table.parquet");
    let file = format!("rig=left/date=2026-03-25/{run}.parquet");
    let written = |files: &[&str]| {
        let said = lab.fleet(&[&["--json", "ingest", "--to", "fleet"], files].concat());
        assert_eq!(said.code, Some(3), "{said:?}");
        let failed = failed(&said.json());
        let [(path, problem)] = failed.as_slice() else { panic!("{failed:?}") };
        assert_eq!(path, "table.parquet");
        assert!(problem.contains("20260325-120000-image"), "{problem}");
        fs::read(lab.path("fleet").join(&file)).unwrap()
    };
    let recorded = written(&["table.parquet", "runs"]);
    assert!(written(&["table.parquet"]) == recorded);
    let sql = "SELECT experiment FROM runs";
    assert!(lab.fleet(&["query", sql]).out.contains("element-centres"));
}

#[test]
fn a_run_does_not_stand_under_a_second_date() {
    let lab = two_tables_of_one_run();
    let ingest = |date| lab.fleet(&["ingest", "mon/press.parquet", "--to", "fleet", "--date", date]);
    assert_eq!(ingest("2026-03-30").code, Some(0));
    let said = ingest("2026-03-31");
    assert_eq!(said.code, Some(3), "{said:?}");
    for told in ["mon/press.parquet", "under 2026-03-30", "under 2026-03-31"] {
        assert!(said.out.contains(told), "{said:?}");
    }
    assert_eq!(lab.files(), ["rig=left/date=2026-03-30/press.parquet"]);
    assert_eq!(ingest("2026-03-30").code, Some(0));
}

/// A run of three presses, and one that goes on with it and does the last two again.
fn continued() -> (Lab, [String; 2]) {
    let lab = Lab::new();
    let runs = ["20260325-120000-image", "20260325-130000-image"];
    lab.record("left", runs[0], NOON_NS, 3);
    lab.record_continued("left", runs[1], NOON_NS + 3_600_000_000_000, runs[0]);
    (lab, runs.map(|run| format!("runs/{run}")))
}

/// Index of the last press of the first run in the fleet.
fn last_press(lab: &Lab) -> Option<i32> {
    let table = table::read(lab.path("fleet").join(&lab.files()[0])).unwrap();
    table.rows().map(|row| row.press).max()
}

#[test]
fn a_run_that_was_cut_where_another_goes_on_is_not_replaced_by_the_whole() {
    let (lab, [first, second]) = continued();
    let ingest = |runs: &[&str]| lab.fleet(&[&["ingest", "--to", "fleet"], runs].concat());
    assert_eq!(ingest(&[&first, &second]).code, Some(0));
    assert_eq!(last_press(&lab), Some(0));
    let said = ingest(&[&first]);
    assert_eq!((said.code, last_press(&lab)), (Some(0), Some(0)), "{said:?}");

    // Recovered, or copied when more of it was there.
    fs::remove_dir_all(lab.path(&first)).unwrap();
    lab.record("left", "20260325-120000-image", NOON_NS, 4);
    let said = ingest(&[&first]);
    assert_eq!((said.code, last_press(&lab)), (Some(3), Some(0)), "{said:?}");
    assert!(said.out.contains("together with") && said.out.contains("20260325-130000-image"), "{said:?}");
    assert_eq!(ingest(&[&first, &second]).code, Some(0));
    assert_eq!(last_press(&lab), Some(0));
}

#[test]
fn a_continuation_beside_the_whole_of_its_run_is_told_in_either_order() {
    for is_first_first in [true, false] {
        let (lab, mut runs) = continued();
        if !is_first_first {
            runs.reverse();
        }
        let ingest = |runs: &[&str]| lab.fleet(&[&["ingest", "--to", "fleet"], runs].concat());
        assert_eq!(ingest(&[&runs[0]]).code, Some(0));
        for _ in 0..2 {
            let said = ingest(&[&runs[1]]);
            assert_eq!(said.code, Some(3), "{said:?}");
            assert!(said.out.contains("ingest the recordings of both together"), "{said:?}");
        }
        assert_eq!(ingest(&[&runs[0], &runs[1]]).code, Some(0));
        assert_eq!(last_press(&lab), Some(0));
    }
}

#[test]
fn frames_of_a_run_and_of_a_collection_are_told_once() {
    let lab = Lab::with_three_runs();
    lab.collect("left", "20260325-120001-left", NOON_NS + 1_000_000_000);
    // Of the other rig, and of a time without a run.
    lab.collect("right", "20260325-130000-right", NOON_NS + 3_600_000_000_000);
    let ingest = || lab.fleet(&["ingest", "runs", "--to", "fleet"]);
    let said = ingest();
    assert_eq!((said.code, said.out.matches("warning: ").count()), (Some(3), 1), "{said:?}");
    for told in ["rig left", "20260325-120000-image in 20260325-120001-left", "1 file of"] {
        assert!(said.out.contains(told), "{said:?}");
    }
    assert_eq!(ingest().code, Some(0));
    let sql = "SELECT run FROM runs WHERE experiment IS DISTINCT FROM 'collect'";
    assert_eq!(lab.fleet(&["--json", "query", sql]).out.lines().count(), 3);
}

#[test]
fn any_object_store_holds_a_fleet() {
    let lab = Lab::with_three_runs();
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let store = Arc::new(InMemory::new());
    let place = Place::of(store.clone(), Url::parse("memory:///labs/fleet").unwrap()).unwrap();
    let options = IngestOptions { threads: NonZeroUsize::MIN, date: None };
    let told = ingest(runtime.handle(), &[lab.path("runs")], &place, &options, &|_| ()).unwrap();
    assert_eq!((told.runs_written, told.failed.len()), (3, 0));
    let path = "labs/fleet/rig=left/date=2026-03-25/20260325-120000-image.parquet";
    runtime.block_on(store.head(&path.into())).unwrap();
    assert_eq!(runtime.block_on(place.files()).unwrap().len(), 3);
    let told = ingest(runtime.handle(), &[lab.path("runs")], &place, &options, &|_| ()).unwrap();
    assert_eq!((told.runs_written, told.runs_kept), (0, 3));
}
