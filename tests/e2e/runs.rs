//! What somebody does with runs afterwards, and with experiments before.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use serde_json::Value;
use tactus_e2e::{CommandOutput, tactus};
use tactus_runner::embedded::SIMULATED_RIG;
use tempfile::TempDir;

const TWO_PRESSES: &str = "def run(rig):\n    tare()\n    for element in [rig.elements[20], rig.elements[27]]:\n        press(element.x_mm, element.y_mm, depths_mm = [0.2, 0.4])\n";

/// The summary of a run on the embedded rig.
fn run(folder: &Path, args: &[&str]) -> Value {
    let said = tactus(folder, &[&["--json"], args, &["--embedded", "--no-report"]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    said.json()
}

fn done(said: CommandOutput) -> CommandOutput {
    assert_eq!(said.code, Some(0), "{said:?}");
    said
}

fn text<'a>(of: &'a Value, key: &str) -> &'a str {
    of[key].as_str().unwrap_or_else(|| panic!("{key} in {of}"))
}

#[test]
fn runs_are_listed_marked_compared_and_made_again() {
    let folder = TempDir::new().unwrap();
    let tactus = |args: &[&str]| tactus(folder.path(), args);
    fs::write(folder.path().join("two.star"), TWO_PRESSES).unwrap();
    let [one, other] = ["1", "2"].map(|seed| run(folder.path(), &["run", "two.star", "--seed", seed]));
    let [first, second] = [&one, &other].map(|run| text(run, "run_id"));

    let listed = done(tactus(&["runs"]));
    assert!(listed.out.contains(first) && listed.out.contains("2 of 2 runs in runs"), "{listed:?}");
    done(tactus(&["runs", "tag", first, "good", "baseline"]));
    done(tactus(&["runs", "tag", first, "baseline", "--remove"]));
    done(tactus(&["runs", "note", second, "the covering had a dent"]));
    // The index is a cache: neither its loss nor its damage changes anything.
    for damage in [None, Some("{"), Some("[]")] {
        let index = folder.path().join("runs/.tactus-runs.json");
        match damage {
            Some(text) => fs::write(index, text).unwrap(),
            None => fs::remove_file(index).unwrap(),
        }
        let good = done(tactus(&["--json", "runs", "--tag", "good"])).json();
        assert_eq!((&good["runs"][0]["run_id"], &good["runs"][1]), (&first.into(), &Value::Null));
        let dented = done(tactus(&["--json", "runs", "DENT", "two"])).json();
        assert_eq!((&dented["runs"][0]["run_id"], &dented["runs"][1]), (&second.into(), &Value::Null));
    }

    let again = run(folder.path(), &["rerun", first]);
    let compared = |other: &str| done(tactus(&["--json", "runs", "compare", first, other])).json();
    assert_eq!(compared(second)["differ"]["seed"], serde_json::json!(["1", "2"]));
    let same = compared(text(&again, "run_id"));
    assert_eq!((&same["differ"], &same["same"]["seed"][0]), (&serde_json::json!({}), &"1".into()), "{same}");

    let there = done(tactus(&["--json", "runs", "--runs", "runs", "compare", first, second])).json();
    assert_eq!(there["differ"]["seed"], serde_json::json!(["1", "2"]), "an option before the word");
    let both = tactus(&["runs", "word", "compare", first, second]);
    assert_eq!(both.code, Some(2), "{both:?}");

    let unknown = tactus(&["rerun", "nothing"]);
    assert_eq!(unknown.code, Some(2), "{unknown:?}");
    assert!(unknown.err.contains("`tactus runs` lists them"), "{unknown:?}");
    let elsewhere = tactus(&["runs", "--runs", "elsewhere"]);
    assert_eq!(elsewhere.code, Some(2), "{elsewhere:?}");
    assert!(elsewhere.err.contains("--runs DIR"), "{elsewhere:?}");
}

#[test]
fn many_recordings_are_told_in_one_table_and_exported_in_any_format() {
    let folder = TempDir::new().unwrap();
    let tactus = |args: &[&str]| tactus(folder.path(), args);
    fs::write(folder.path().join("two.star"), TWO_PRESSES).unwrap();
    let moved = SIMULATED_RIG.replace("origin_mm = [20.0, 15.0]", "origin_mm = [21.0, 15.0]");
    assert_ne!(moved, SIMULATED_RIG, "the rig file has changed");
    fs::write(folder.path().join("moved.toml"), moved.replace("name = \"sim\"", "name = \"moved\"")).unwrap();
    let here = run(folder.path(), &["run", "two.star"]);
    let there = run(folder.path(), &["run", "two.star", "--rig-file", "moved.toml"]);
    let [here, there] = [&here, &there].map(|run| text(run, "recording").to_owned());

    let table = done(tactus(&["record", "info", &here, &there]));
    let lines: Vec<_> = table.out.lines().collect();
    assert_eq!(lines.len(), 3, "{table:?}");
    let column = lines[0].find("FILE").unwrap();
    assert_eq!([&lines[1][column..], &lines[2][column..]], [&here, &there]);
    fs::write(folder.path().join("none.mcap"), "none").unwrap();
    let told = tactus(&["--json", "record", "info", "none.mcap", &here]);
    assert_eq!(told.code, Some(1), "{told:?}");
    assert_eq!(told.json()["recordings"].as_array().map(Vec::len), Some(1));
    assert_eq!(told.json()["unreadable"][0]["path"], "none.mcap");

    for command in ["calibrate", "discover", "export"] {
        let said = tactus(&[command, &here, &there]);
        assert_eq!(said.code, Some(1), "{said:?}");
        let groups = format!("\n  rig \"sim\": {here}\n  rig \"moved\": {there}");
        assert!(said.err.contains("registration.origin_mm is [21.0,15.0], not [20.0,15.0]"), "{said:?}");
        assert!(said.err.contains("The files are of 2 rigs") && said.err.contains(&groups), "{said:?}");
    }

    for (out, format, begins) in [
        ("t.csv", None, &b"run,press,phase,t_ns,"[..]),
        ("t.npz", None, b"PK\x03\x04"),
        ("t.parquet", None, b"PAR1"),
        ("t.txt", Some("csv"), b"run,press,"),
    ] {
        let format = format.map(|format| ["--format", format]);
        let args = [&["export", &here, "--out", out][..], format.as_ref().map_or(&[], |format| format)];
        done(tactus(&args.concat()));
        assert!(fs::read(folder.path().join(out)).unwrap().starts_with(begins), "{out}");
    }
    let said = tactus(&["export", &here, "--out", "t.mcap"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("is MCAP already") && said.err.contains(".csv"), "{said:?}");
}

#[test]
fn experiments_are_listed_begun_and_their_errors_shown() {
    let folder = TempDir::new().unwrap();
    let tactus = |args: &[&str]| tactus(folder.path(), args);
    let listed = done(tactus(&["--json", "experiments"])).json();
    let centres =
        listed["experiments"].as_array().unwrap().iter().find(|one| one["name"] == "element-centres");
    let centres = centres.unwrap();
    assert!(!text(centres, "summary").is_empty() && !centres["parameters"].as_array().unwrap().is_empty());
    let explained = done(tactus(&["experiments", "diagnose"]));
    assert!(explained.out.contains("depth_share") && explained.out.contains("tactus plan diagnose"));

    let begun = done(tactus(&["new", "touch"]));
    assert!(begun.out.contains("tactus plan ./touch.star"), "{begun:?}");
    let planned = done(tactus(&["plan", "touch.star", "--embedded"]));
    assert!(planned.out.contains("`tactus run touch.star --embedded` does it"), "{planned:?}");
    assert_eq!(tactus(&["new", "touch"]).code, Some(1), "a file is never replaced");
    assert_eq!(tactus(&["new", "../touch"]).code, Some(2), "a name is no path");
    let reference = done(tactus(&["script", "reference"]));
    assert!(
        ["def press(", "def tare(", "def param("].iter().all(|one| reference.out.contains(one)),
        "{reference:?}"
    );

    for (source, place, caret) in [
        ("def run(rig):\n    pres(1.0, 1.0)\n", "bad.star:2", "  2 |     pres(1.0, 1.0)\n    |     ^"),
        ("def run(rig):\n    tare()\n    wait(-1)\n", "bad.star:3", "  3 |     wait(-1)\n    |     ^"),
        ("def run(rig)\n    pass\n", "bad.star:1", "  1 | def run(rig)\n    |"),
    ] {
        fs::write(folder.path().join("bad.star"), source).unwrap();
        for command in ["plan", "run"] {
            let said = tactus(&[command, "bad.star", "--embedded"]);
            let all = format!("{}{}", said.out, said.err);
            assert!(said.code != Some(0) && all.contains(place) && all.contains(caret), "{all}");
        }
    }
}
