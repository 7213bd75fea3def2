//! Bad input gives a clear error with the place and a nonzero exit code; it moves nothing and loses nothing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;

use tactus_e2e::{repository, tactus};
use tempfile::TempDir;

#[test]
fn a_script_that_presses_too_deep_is_refused_with_its_line_and_nothing_is_recorded() {
    let folder = TempDir::new().unwrap();
    fs::write(
        folder.path().join("deep.star"),
        "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.3])\n    press(5.0, 5.0, depths_mm = [0.9])\n",
    )
    .unwrap();
    for command in ["run", "plan"] {
        let said = tactus(folder.path(), &[command, "deep.star", "--embedded"]);
        assert_eq!(said.code, Some(4), "{said:?}");
        let text = format!("{}{}", said.out, said.err);
        assert!(
            text.contains("deep.star:3") && text.contains("0.9 mm is too deep") && text.contains("0.711"),
            "{text}"
        );
    }
    assert!(!folder.path().join("runs").exists(), "nothing was run");
}

#[test]
fn a_script_with_an_error_is_refused_with_its_line() {
    let folder = TempDir::new().unwrap();
    for (source, line, word) in [
        ("def run(rig):\n    pres(1.0, 1.0)\n", "bad.star:2", "pres"),
        ("def run(rig)\n    pass\n", "bad.star:1", "expected"),
        ("def run(rig):\n    while True:\n        pass\n", "bad.star:2", ""),
        ("def run(rig):\n    press(1.0, 1.0, depths_mm = [])\n", "bad.star:2", "depths_mm"),
        ("load(\"//etc/passwd\", \"x\")\ndef run(rig):\n    pass\n", "bad.star:1", "load"),
    ] {
        fs::write(folder.path().join("bad.star"), source).unwrap();
        let said = tactus(folder.path(), &["plan", "bad.star", "--embedded"]);
        assert!(matches!(said.code, Some(1 | 2)), "{source}: {said:?}");
        let text = format!("{}{}", said.out, said.err);
        assert!(text.contains(line) && text.to_lowercase().contains(word), "{source}: {text}");
    }
}

#[test]
fn a_misspelt_key_is_refused_with_its_line() {
    let folder = TempDir::new().unwrap();
    let config = fs::read_to_string(repository("config/tactusd.toml")).unwrap();
    fs::write(folder.path().join("tactusd.toml"), config.replace("recordings =", "recodings =")).unwrap();
    let said = tactus(folder.path(), &["validate", "tactusd.toml"]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.err.contains("recodings") && said.err.contains("line"), "{}", said.err);
}

#[test]
fn what_is_wrong_is_said_once_with_the_files_name() {
    let folder = TempDir::new().unwrap();
    let rig = fs::read_to_string(repository("config/rigs/sim.toml")).unwrap();
    let visible = rig.split("# What the virtual devices hide").next().unwrap();
    fs::write(folder.path().join("my-rig.toml"), visible).unwrap();
    let said = tactus(folder.path(), &["validate", "my-rig.toml"]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert_eq!(said.err.trim(), "my-rig.toml: simulation: missing; a simulated rig needs it");
}

#[test]
fn a_recording_cut_short_is_told_and_recovered() {
    let folder = TempDir::new().unwrap();
    fs::write(
        folder.path().join("one.star"),
        "def run(rig):\n    press(5.0, 5.0, depths_mm = [0.2, 0.3])\n    wait(60)\n",
    )
    .unwrap();
    let summary = tactus(folder.path(), &["--json", "run", "one.star", "--embedded", "--no-report"]).json();
    // A third of the file ends within the frames: the summary with its schemas takes about 120 kB, the frames of
    // this run twice that.
    let whole = fs::read(summary["recording"].as_str().unwrap()).unwrap();
    fs::write(folder.path().join("cut.mcap"), &whole[..whole.len() / 3]).unwrap();

    let info = tactus(folder.path(), &["record", "info", "cut.mcap"]);
    assert_eq!(info.code, Some(3), "{info:?}");
    assert!(info.err.contains("recover"), "{}", info.err);
    let validated = tactus(folder.path(), &["validate", "cut.mcap"]);
    assert_eq!(validated.code, Some(1), "{validated:?}");
    let recovered = tactus(folder.path(), &["--json", "recover", "cut.mcap", "--out", "whole.mcap"]);
    assert_eq!(recovered.code, Some(3), "the cut is within a chunk, which is lost: {recovered:?}");
    let info = tactus(folder.path(), &["--json", "record", "info", "whole.mcap"]).json();
    assert_eq!(info["exit_status"], "crashed");
    let frames = info["frames"].as_u64().unwrap();
    assert!(
        frames > 100 && frames < summary["frames"].as_u64().unwrap(),
        "{frames} of {}",
        summary["frames"]
    );
}

#[test]
fn what_is_no_recording_or_table_at_all_is_told() {
    let folder = TempDir::new().unwrap();
    for name in ["noise.mcap", "noise.parquet"] {
        fs::write(folder.path().join(name), b"this is neither").unwrap();
        let said = tactus(folder.path(), &["validate", name]);
        assert_eq!(said.code, Some(1), "{said:?}");
        assert!(said.err.contains(name), "{}", said.err);
    }
}

#[test]
fn an_unknown_experiment_names_those_that_exist() {
    let folder = TempDir::new().unwrap();
    let said = tactus(folder.path(), &["run", "element-centers"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("element-centres"), "{}", said.err);
}
