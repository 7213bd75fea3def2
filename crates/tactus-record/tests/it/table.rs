//! Tables as other tools write them. `tests/tables/make_tables.py` made them, with pyarrow, pandas and polars.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::{
    fs::{self, File},
    path::PathBuf,
};

use parquet::file::reader::{FileReader, SerializedFileReader};
use tactus_record::table::{self, ResidualWriter, TableError, TableWriter};
use tactus_schema::{
    Rig,
    table::{Phase, RowView},
};

/// A folder with measured data beside the repository; it may be absent.
const MEASURED: &str = "../../../shared/data/eflesh-normal-20250401_014340.parquet";

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/tables")
}

fn named(beginning: &str) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "parquet"))
        .filter(|path| path.file_stem().unwrap().to_str().unwrap().starts_with(beginning))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "no table {beginning}*");
    paths
}

#[test]
fn tables_of_every_physical_layout_read_the_same() {
    for path in named("valid_") {
        let table = table::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert_eq!(table.head().rig.array.elements(), 4, "{name}");
        assert_eq!(table.len(), 6, "{name}");
        let runs: Vec<_> = table.runs().iter().map(|run| (&*run.run, run.rows.clone())).collect();
        assert_eq!(runs, [("a", 0..4), ("b", 4..6)], "{name}");
        let temperature_c = if name == "valid_pandas_null_temperature" { None } else { Some(21.5) };
        let expected = RowView {
            run: "a",
            press: 0,
            phase: Phase::Hold,
            t_ns: 70_000_000,
            position_mm: [20.9, 15.9, -0.2],
            covering_mm: 1.016,
            indenter: "cyl1",
            temperature_c,
            counts: &[102.0, 101.0, 102.5, 99.0],
        };
        assert_eq!(table.rows().nth(2), Some(expected), "{name}");
        let validated = table::validate(&path).unwrap();
        assert_eq!((validated.rows, validated.runs), (6, 2), "{name}");
    }
}

#[test]
fn a_missing_column_is_named() {
    for path in named("missing_") {
        let column = path.file_stem().unwrap().to_str().unwrap().strip_prefix("missing_").unwrap().to_owned();
        let error = table::validate(&path).unwrap_err();
        assert!(
            matches!(error, TableError::ColumnMissing { column: named, .. } if named == column),
            "{error}"
        );
    }
}

#[test]
fn a_wrong_type_is_named_with_what_was_expected() {
    for (file, column, found, expected) in [
        ("type_press", "press", "int64", "int32"),
        ("type_run", "run", "binary", "string"),
        ("type_t_ns", "t_ns", "timestamp", "int64"),
        ("type_x_mm", "x_mm", "float32", "float64"),
        ("type_counts", "counts", "list<float64>", "list<float32>"),
        ("type_counts_plain", "counts", "float32", "list<float32>"),
        ("type_phase", "phase", "uint8", "string"),
    ] {
        let text = table::validate(folder().join(format!("{file}.parquet"))).unwrap_err().to_string();
        assert!(text.contains(&format!("column {column}: {found}")), "{text}");
        assert!(text.ends_with(&format!("expected {expected}")), "{text}");
    }
}

#[test]
fn a_wrong_value_is_named_with_its_row_and_column() {
    for (file, row, column, what) in [
        ("value_run_null", 3, "run", "null"),
        ("value_run_again", 5, "run", "contiguous"),
        ("value_press", 2, "press", "-2"),
        ("value_phase", 4, "phase", "\"resting\"; one of idle"),
        ("value_t_ns", 2, "t_ns", "32999999 after 33000000"),
        ("value_t_ns_null", 1, "t_ns", "null"),
        ("value_x_mm", 0, "x_mm", "inf"),
        ("value_y_mm", 5, "y_mm", "null"),
        ("value_z_mm", 1, "z_mm", "NaN"),
        ("value_covering_mm", 3, "covering_mm", "0; a thickness above 0"),
        ("value_indenter", 2, "indenter", "\"cyl9\"; the rig has cyl1"),
        ("value_temperature_c", 4, "temperature_c", "-inf"),
        ("value_counts_short", 5, "counts", "3 values; the rig's array has 4 elements"),
        ("value_counts_empty", 0, "counts", "0 values"),
        ("value_counts_null", 3, "counts", "null"),
        ("value_counts_hole", 2, "counts", "null"),
        ("value_counts_nan", 4, "counts", "element 2 is NaN"),
    ] {
        let error = table::validate(folder().join(format!("{file}.parquet"))).unwrap_err();
        assert_eq!((error.row(), error.column()), (Some(row), Some(column)), "{file}: {error}");
        assert!(error.to_string().contains(what), "{file}: {error}");
    }
}

#[test]
fn a_small_file_with_endless_values_is_refused_before_they_are_decoded() {
    let path = folder().join("long_counts.parquet");
    assert!(fs::metadata(&path).unwrap().len() < 20_000);
    let error = table::validate(path).unwrap_err().to_string();
    assert!(error.contains("column counts: more than 8240 values for 6 rows"), "{error}");
    let error = table::validate(folder().join("long_run.parquet")).unwrap_err();
    assert_eq!((error.row(), error.column()), (Some(0), Some("run")), "{error}");
}

#[test]
fn a_table_without_its_rig_is_refused() {
    let missing = table::validate(folder().join("rig_missing.parquet")).unwrap_err();
    assert!(matches!(missing, TableError::RigMissing { .. }), "{missing}");
    let wrong = table::validate(folder().join("rig_wrong.parquet")).unwrap_err();
    assert!(matches!(wrong, TableError::Rig { .. }), "{wrong}");
    assert!(wrong.to_string().contains("tactus.rig/2"), "{wrong}");
}

#[test]
fn what_is_not_parquet_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("table.parquet");
    let absent = table::validate(&path).unwrap_err();
    assert!(matches!(absent, TableError::Io { action: "open", .. }), "{absent}");
    for bytes in [&b""[..], b"PAR1", b"run,press\na,1\n", b"PAR1aaaaaaaaaaaaaaaaPAR1"] {
        fs::write(&path, bytes).unwrap();
        let error = table::validate(&path).unwrap_err();
        assert!(matches!(error, TableError::Parquet { .. }), "{error}");
    }
}

#[test]
fn a_cut_or_flipped_table_never_panics() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("table.parquet");
    for name in ["valid_pyarrow", "valid_item", "valid_polars"] {
        let whole = fs::read(folder().join(format!("{name}.parquet"))).unwrap();
        for at in (0..whole.len()).step_by(31) {
            fs::write(&path, &whole[..at]).unwrap();
            assert!(table::validate(&path).is_err(), "{name} cut at {at}");
            let mut flipped = whole.clone();
            flipped[at] ^= 1 << (at % 8);
            fs::write(&path, &flipped).unwrap();
            // Most values have no checksum, so a flip may pass; it must not panic.
            let _unpredictable = table::read(&path).is_ok();
        }
    }
}

#[test]
fn the_writer_refuses_what_the_reader_would() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("table.parquet");
    let example = table::read(folder().join("valid_pyarrow.parquet")).unwrap();
    let rig_json = &example.head().metadata["tactus.rig"];
    let mut writer = TableWriter::create(&path, rig_json).unwrap();
    for row in example.rows() {
        writer.push(row).unwrap();
    }
    let last = example.rows().last().unwrap();
    let error = writer.push(RowView { t_ns: 39_999_999, ..last }).unwrap_err();
    assert_eq!((error.row(), error.column()), (Some(6), Some("t_ns")));
    let error = writer.push(RowView { counts: &[1.0], ..last }).unwrap_err();
    assert_eq!(error.column(), Some("counts"));
    assert!(!path.exists(), "not there until it is whole");
    assert_eq!(writer.finish().unwrap(), 6);
    let back = table::read(&path).unwrap();
    assert!(back.rows().eq(example.rows()));
    assert_eq!(&back.head().metadata["tactus.rig"], rig_json);
}

#[test]
fn a_measured_table_is_valid() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(MEASURED);
    if !path.exists() {
        println!("not checked: {} is not there", path.display());
        return;
    }
    let table = table::read(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((table.len(), table.runs().len()), (3600, 1));
    assert_eq!(table.head().rig.array.elements(), 15);
    let first = table.rows().next().unwrap();
    assert_eq!((first.phase, first.press, first.counts[2]), (Phase::Idle, -1, 18822.0));
}

#[test]
fn residuals_are_measured_minus_predicted_and_say_of_which_rig() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("residuals.parquet");
    let table = table::read(folder().join("valid_pyarrow.parquet")).unwrap();
    let rig = &table.head().rig;
    let mut writer = ResidualWriter::create(&path, rig, true).unwrap();
    for row in table.rows() {
        let below: Vec<f32> = row.counts.iter().map(|counts| counts - 3.0).collect();
        writer.push(&row, row.press == 0, &below, row.counts).unwrap();
    }
    assert!(!path.exists(), "it stands there only when it is whole");
    writer.finish().unwrap();
    let file = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
    let metadata = file.metadata().file_metadata().key_value_metadata().unwrap();
    let value = |key: &str| metadata.iter().find(|pair| pair.key == key).unwrap().value.clone().unwrap();
    assert_eq!(Rig::from_json(&value("tactus.rig")).unwrap(), *rig);
    assert_eq!(value("tactus.simulated"), "true");
    let rows: Vec<String> = file.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).collect();
    assert_eq!(rows.len(), 6);
    assert_eq!(
        rows[2],
        "{run: \"a\", press: 0, phase: \"hold\", t_ns: 70000000, x_mm: 20.9, y_mm: 15.9, z_mm: -2E-1, \
         held_out: true, residual_before: [3.0, 3.0, 3.0, 3.0], residual_after: [0E0, 0E0, 0E0, 0E0]}"
    );
}
