//! Starting the program, with and without errors. `cargo test` builds `tactusd`, which the end-to-end tests start, because of this file.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::process::{Command, Output};

fn tactusd(config: &str) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tactusd.toml");
    std::fs::write(&path, config).unwrap();
    Command::new(env!("CARGO_BIN_EXE_tactusd")).arg("--config").arg(&path).output().unwrap()
}

#[test]
fn a_missing_configuration_is_a_usage_error_that_names_it() {
    let output =
        Command::new(env!("CARGO_BIN_EXE_tactusd")).args(["--config", "nowhere.toml"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("nowhere.toml"), "{said}");
}

#[test]
fn an_unknown_key_is_refused_before_anything_starts() {
    let output = tactusd("rig = \"rig.toml\"\nsped = 3\n");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("sped"), "{said}");
}
