//! What the program says of itself.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Command, Output};

fn tactus(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tactus")).args(args).output().unwrap()
}

#[test]
fn the_help_names_every_command() {
    let help = String::from_utf8(tactus(&["--help"]).stdout).unwrap();
    for command in [
        "run",
        "plan",
        "experiments",
        "new",
        "script",
        "runs",
        "rerun",
        "status",
        "stop",
        "pause",
        "resume",
        "reset",
        "watch",
        "record",
        "export",
        "recover",
        "report",
        "discover",
        "fleet",
        "stage",
        "validate",
        "completions",
    ] {
        assert!(help.lines().any(|line| line.trim_start().starts_with(command)), "{command} in {help}");
    }
}

#[test]
fn completions_are_there_for_each_shell() {
    for (shell, word) in [
        ("bash", "complete"),
        ("zsh", "#compdef tactus"),
        ("fish", "complete --keep-order --exclusive --command tactus"),
    ] {
        let completions = tactus(&["completions", shell]);
        assert!(completions.status.success());
        assert!(String::from_utf8(completions.stdout).unwrap().contains(word), "{shell}");
    }
}

/// What bash is offered for the last of the words, besides options.
fn offered(folder: &Path, words: &[&str]) -> Vec<String> {
    let mut asked = Command::new(env!("CARGO_BIN_EXE_tactus"));
    asked.env("COMPLETE", "bash").env("_CLAP_COMPLETE_INDEX", words.len().to_string());
    // Nothing is served there.
    asked.env("_CLAP_IFS", "\n").env("TACTUS_ENDPOINT", "tcp/127.0.0.1:1");
    let said = asked.arg("--").arg("tactus").args(words).current_dir(folder).output().unwrap();
    assert!(said.status.success(), "{said:?}");
    let lines = String::from_utf8(said.stdout).unwrap();
    lines.lines().filter(|line| !line.starts_with("--")).map(str::to_owned).collect()
}

#[test]
fn completions_know_experiments_rigs_and_runs() {
    let folder = tempfile::tempdir().unwrap();
    let run = "20260101-120000-corners-0a1b";
    for (path, text) in
        [("mine.star", ""), ("config/rigs/bench.toml", ""), (&format!("runs/set/{run}/recording.mcap"), "")]
    {
        let path = folder.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let offered = |words: &[&str]| offered(folder.path(), words);
    assert_eq!(offered(&["run", "cor"]), ["corners"]);
    let experiments = offered(&["plan", ""]);
    for name in ["corners", "diagnose", "mine.star"] {
        assert!(experiments.iter().any(|one| one == name), "{name} in {experiments:?}");
    }
    for words in [&["rerun", ""][..], &["run", "--continue", "2026"], &["runs", "tag", "20"]] {
        assert_eq!(offered(words), [run], "{words:?}");
    }
    for words in [&["run", "--rig-file", "config/rigs/b"][..], &["devices", "--rig", "config/rigs/b"]] {
        assert_eq!(offered(words), ["config/rigs/bench.toml"], "{words:?}");
    }
}

#[test]
fn wrong_usage_is_exit_code_2_and_a_missing_service_says_how_to_start_one() {
    assert_eq!(tactus(&["runn"]).status.code(), Some(2));
    let status = tactus(&["--endpoint", "tcp/127.0.0.1:1", "status"]);
    assert_eq!(status.status.code(), Some(1));
    let said = String::from_utf8(status.stderr).unwrap();
    assert!(said.contains("no service at tcp/127.0.0.1:1") && said.contains("tactusd --config"), "{said}");
    let endpoint = tactus(&["--endpoint", "nowhere", "status"]);
    assert_eq!(endpoint.status.code(), Some(2));
}

#[test]
fn a_stage_check_on_the_embedded_rig_needs_nothing() {
    let checked = tactus(&["stage", "check", "--home"]);
    let said = String::from_utf8(checked.stdout).unwrap();
    assert_eq!(checked.status.code(), Some(0), "{said}");
    let header = "axis  asked mm  reported mm  error um  took ms  verdict";
    assert!(said.lines().any(|line| line == header), "{said}");
}

#[test]
fn fleet_hands_over_to_its_program_or_says_how_to_build_it() {
    let folder = tempfile::tempdir().unwrap();
    let fleet = |path: &Path, args: &[&str]| {
        let mut tactus = Command::new(env!("CARGO_BIN_EXE_tactus"));
        tactus.env("PATH", path).args(args).output().unwrap()
    };
    let said = fleet(folder.path(), &["fleet", "query", "SELECT 1"]);
    assert_eq!(said.status.code(), Some(1));
    let error = String::from_utf8(said.stderr).unwrap();
    assert!(error.contains("cargo build --release --manifest-path fleet/Cargo.toml"), "{error}");

    let program = folder.path().join("tactus-fleet");
    fs::write(&program, "#!/bin/sh\nprintf '%s\\n' \"$@\"\nexit 3\n").unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let args = ["--json", "fleet", "query", "SELECT 1", "--at", "fleet", "--help"];
    let said = fleet(folder.path(), &args);
    assert_eq!(said.status.code(), Some(3), "{said:?}");
    assert_eq!(String::from_utf8(said.stdout).unwrap(), "--json\nquery\nSELECT 1\n--at\nfleet\n--help\n");
}
