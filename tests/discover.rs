//! Discovery on the command line: what it refuses.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use tactus_e2e::{Said, repository, tactus};
use tempfile::TempDir;

/// Discovers in an empty folder, where nothing may be left behind.
fn refused(files: &[&str], more: &[&str]) -> Said {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("noise.mcap"), [0xA5; 512]).unwrap();
    fs::write(folder.path().join("bad.toml"), "schema = \"tactus.model/1\"\n").unwrap();
    let said = tactus(folder.path(), &[&["discover"], files, more].concat());
    assert!(!folder.path().join("discovery").exists(), "{said:?}");
    assert!(said.out.is_empty(), "{said:?}");
    said
}

/// A table of the tests of `tactus-record`.
fn table(name: &str) -> String {
    let path = repository("crates/tactus-record/tests/tables").join(name);
    path.to_str().unwrap().to_owned()
}

#[test]
fn without_a_file_nothing_is_discovered() {
    assert_eq!(refused(&[], &[]).code, Some(2));
    let said = refused(&["nowhere.mcap"], &[]);
    assert_eq!(said.code, Some(1));
    assert!(said.err.contains("nowhere.mcap"), "{said:?}");
}

#[test]
fn what_is_neither_recording_nor_table_is_refused() {
    let said = refused(&["noise.mcap"], &[]);
    assert_eq!(said.code, Some(1));
    assert!(said.err.contains("noise.mcap"), "{said:?}");
}

#[test]
fn a_table_that_breaks_the_contract_is_refused_with_row_and_column() {
    let said = refused(&[&table("value_counts_nan.parquet")], &[]);
    assert_eq!(said.code, Some(1));
    assert!(said.err.contains("row 4, column counts"), "{said:?}");
    let said = refused(&[&table("missing_press.parquet")], &[]);
    assert!(said.err.contains("column press: missing"), "{said:?}");
}

#[test]
fn a_model_of_another_array_is_refused_with_both() {
    let model = repository("config/models/digitacts.toml");
    let said = refused(&[&table("valid_pyarrow.parquet")], &["--model", model.to_str().unwrap()]);
    assert_eq!(said.code, Some(1));
    for name in ["digitacts.toml", "\"digitacts\" (6 rows of 8", "\"square\" (2 rows of 2"] {
        assert!(said.err.contains(name), "{name}: {said:?}");
    }
}

#[test]
fn what_is_no_model_is_refused_before_anything_is_read() {
    let said = refused(&["nowhere.mcap"], &["--model", "bad.toml"]);
    assert_eq!(said.code, Some(2));
    assert!(said.err.contains("bad.toml") && said.err.contains("base"), "{said:?}");
}

#[test]
fn no_threads_are_too_few() {
    assert_eq!(refused(&["nowhere.mcap"], &["--threads", "0"]).code, Some(2));
}
