//! The command `tactus-mock hidden`, as a user sees it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

fn hidden(folder: &TempDir, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tactus-mock"));
    command.current_dir(folder.path()).arg("hidden").args(args).output().unwrap()
}

#[test]
fn sets_and_their_labels_go_to_different_folders() {
    let folder = TempDir::new().unwrap();
    let make = ["make", "--out", "sets", "--sealed", "labels", "--count", "3", "--frames", "300"];
    let done = hidden(&folder, &[&make[..], &["--effect", "hysteresis", "--seed", "4"]].concat());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(done.stdout.is_empty());
    for set in 0..3 {
        let table = folder.path().join(format!("sets/set-{set:04}.parquet"));
        assert_eq!(tactus_record::table::validate(table).unwrap().rows, 300);
        let label = fs::read(folder.path().join(format!("labels/set-{set:04}.json"))).unwrap();
        let label: Value = serde_json::from_slice(&label).unwrap();
        assert_eq!(label["physics"][0]["effect"], "hysteresis");
    }
    assert_eq!(fs::read_dir(folder.path().join("sets")).unwrap().count(), 3);
}

#[test]
fn the_list_says_which_effect_each_physics_is() {
    let folder = TempDir::new().unwrap();
    let listed: Vec<Value> = serde_json::from_slice(&hidden(&folder, &["list", "--json"]).stdout).unwrap();
    let prony = listed.iter().find(|physics| physics["id"] == "relaxation-prony").unwrap();
    assert_eq!((&prony["effect"], &prony["is_library_point"]), (&"relaxation".into(), &false.into()));
    assert!(listed.iter().any(|physics| physics["effect"].is_null()));
}

#[test]
fn an_unknown_physics_is_refused_with_where_to_look() {
    let folder = TempDir::new().unwrap();
    let refused = hidden(&folder, &["make", "--out", "a", "--sealed", "b", "--physics", "magic"]);
    assert!(!refused.status.success());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("tactus-mock hidden list"));
}
