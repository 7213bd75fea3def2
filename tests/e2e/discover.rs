//! Discovery on the command line: refused input, and predictions of its model for a new run.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;
use std::{fs, thread};

use rustix::fs::{CWD, Mode, mkfifoat};
use rustix::process::Signal;
use serde_json::Value;
use tactus_e2e::{CommandOutput, Process, Terminal, binary, computed, repository, tactus};
use tactus_record::rows;
use tactus_record::table::TableWriter;
use tactus_schema::DraftFile;
use tactus_schema::draft::{DraftStatus, stage_name};
use tactus_schema::table::Row;
use tempfile::TempDir;

/// Runs a discovery that must be refused, in an empty folder that must stay empty.
fn refused(files: &[&str], more: &[&str]) -> CommandOutput {
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
fn a_tolerance_of_nothing_is_refused() {
    let said = refused(&["nowhere.mcap"], &["--tolerance", "0"]);
    assert_eq!(said.code, Some(2));
    assert!(said.err.contains("--tolerance must be above 0 counts"), "{said:?}");
}

#[test]
fn no_threads_are_too_few() {
    assert_eq!(refused(&["nowhere.mcap"], &["--threads", "0"]).code, Some(2));
}

#[test]
fn too_few_presses_are_refused_with_what_to_do() {
    let folder = TempDir::new().unwrap();
    let script = "\"\"\"One press.\"\"\"\ndef run(rig):\n    press(8.1, 5.9, [0.3])\n";
    fs::write(folder.path().join("one.star"), script).unwrap();
    let said = tactus(folder.path(), &["--json", "run", "one.star", "--embedded", "--no-report"]);
    let recording = said.json()["recording"].as_str().unwrap().to_owned();
    let said = tactus(folder.path(), &["discover", &recording]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(
        said.err.contains("presses can be fitted; at least") && said.err.contains("tactus run diagnose"),
        "{said:?}"
    );
    assert!(!folder.path().join("discovery").exists());
}

#[test]
fn experiments_on_another_rig_than_the_datas_are_refused_with_both_named() {
    let rig = repository("config/rigs/sim.toml");
    let active = ["--active", "--rig-file", rig.to_str().unwrap()];
    let said = refused_aloud(&[&table("valid_pyarrow.parquet")], &active);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("the data are of rig ") && said.err.contains("rig \"sim\""), "{said:?}");
    assert!(
        said.out.starts_with("SIMULATED: experiments run on the embedded simulated rig \"sim\""),
        "{said:?}"
    );
    assert_eq!(refused(&["nowhere.mcap"], &["--embedded"]).code, Some(2), "without --active");
}

/// As `refused`, after a first line of output.
fn refused_aloud(files: &[&str], more: &[&str]) -> CommandOutput {
    let folder = TempDir::new().unwrap();
    let said = tactus(folder.path(), &[&["discover"], files, more].concat());
    assert!(!folder.path().join("discovery").exists(), "{said:?}");
    said
}

/// A rig that hides nothing by itself, and a truth file with hidden physics of a strength; 1 is a bad rig.
fn hide(folder: &Path, physics: &str, strength: f64) {
    let text = fs::read_to_string(repository("config/rigs/sim.toml")).unwrap();
    let mut rig: toml::Table = toml::from_str(&text).unwrap();
    let simulation = rig["simulation"].as_table_mut().unwrap();
    simulation.remove("miswired");
    let nowhere: toml::Table = toml::from_str("origin_mm = [0.0, 0.0]\nrotation_deg = 0.0").unwrap();
    simulation.insert("registration_error".into(), nowhere.into());
    simulation.insert("quadratic_per_mm".into(), 0.0.into());
    fs::write(folder.join("rig.toml"), toml::to_string(&rig).unwrap()).unwrap();
    let hidden = format!(
        "schema = \"tactus.hidden/1\"\n[[physics]]\nid = \"{physics}\"\nstrength = {strength:?}\nseed = 7\n"
    );
    fs::write(folder.join("hidden.toml"), hidden).unwrap();
}

/// Runs a short diagnosis of the rig. Returns its recording.
fn diagnosed(folder: &Path, truth: &[&str], seed: &str) -> String {
    let run = ["--json", "run", "diagnose", "--embedded", "--no-report", "--rig-file", "rig.toml"];
    let said = tactus(folder, &[&run[..], &["-p", "scale=0.1", "--seed", seed], truth].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    said.json()["recording"].as_str().unwrap().to_owned()
}

fn counts(recording: &str) -> Vec<f32> {
    let mut counts = Vec::new();
    rows::visit(&[Path::new(recording)], |_, row| counts.extend_from_slice(row.counts)).unwrap();
    counts
}

/// Root mean square of the differences between two runs with the same seed, and so the same noise.
fn gap_counts(one: &str, other: &str) -> f64 {
    let (one, other) = (counts(one), counts(other));
    assert_eq!(one.len(), other.len());
    let squares: f64 = one.iter().zip(&other).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    (squares / one.len() as f64).sqrt()
}

/// Diagnoses a rig with hidden physics and discovers a model. Then makes the experiment with another seed on that rig, on
/// the rig without hidden physics, and on a rig with the discovered model. Returns the report.
fn is_named_and_closed(physics: &str, effect: &str, times_smaller: f64) -> Value {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    hide(folder, physics, 1.0);
    let first = diagnosed(folder, &["--truth", "hidden.toml"], "1");
    let said = tactus(folder, &["--json", "discover", &first]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let found = said.json();
    let names: Vec<&Value> = found["steps"].as_array().unwrap().iter().map(|step| &step["effect"]).collect();
    assert!(names.contains(&&Value::from(effect)), "{physics}: {names:?}");
    let new = diagnosed(folder, &["--truth", "hidden.toml"], "2");
    let without = gap_counts(&new, &diagnosed(folder, &[], "2"));
    let grown = gap_counts(&new, &diagnosed(folder, &["--truth", "discovery/model.toml"], "2"));
    assert!(
        without > times_smaller * grown,
        "{physics}: {without} counts without, {grown} with the grown model"
    );
    found
}

#[test]
fn a_relaxing_covering_is_named_and_the_grown_model_closes_the_gap_on_a_new_run() {
    is_named_and_closed("relaxation-prony", "relaxation", 3.0);
}

#[test]
fn a_sloping_surface_is_named_and_the_grown_model_closes_the_gap_on_a_new_run() {
    is_named_and_closed("sloping-surface", "surface-tilt", 2.0);
}

#[test]
fn dead_elements_are_named_with_calibrates_evidence_and_the_grown_model_closes_the_gap_on_a_new_run() {
    let found = is_named_and_closed("dead-element", "miswired", 3.0);
    let faulty = found["faulty"].as_array().unwrap();
    let dead: Vec<&Value> = faulty.iter().map(|one| &one["element"]).collect();
    let terms = found["steps"][0]["terms"].as_array().unwrap();
    let named: Vec<f64> = terms.iter().map(|term| term["element"]["value"].as_f64().unwrap()).collect();
    assert!(
        !dead.is_empty() && dead.iter().map(|one| one.as_f64().unwrap()).eq(named),
        "{faulty:?}, {terms:?}"
    );
    assert!(faulty.iter().all(|one| one["kind"]["kind"] == "dead"), "{faulty:?}");
    assert!(
        faulty[0]["evidence"].as_str().unwrap().contains("where the median element rises by"),
        "{faulty:?}"
    );
}

/// A draft that somebody stated.
const STATED: &str = r#"
schema = "tactus.draft/1"
status = "drafted"

[effect]
name = "NAME"
sentence = "While the tool touches, counts are added."
stage = "readout"
carrier = "counts"
combine = "add"
when = "in contact"
law = "linear"
numbers = { offset = 3.0, slope = 1.0 }

[[effect.covariate]]
name = "depth"
unit = "mm"
range = [0.0, 0.6]
"#;

/// Hides physics that no effect of the library is, diagnoses the rig, and discovers with an experiment that confirms the draft. Then makes the
/// experiment with another seed on that rig, on the rig without hidden physics, and on one with the draft in its model; and discovers
/// with the draft in the library.
fn is_drafted_and_confirmed(physics: &str, strength: f64, [stage, carrier, covariate]: [&str; 3]) {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    hide(folder, physics, strength);
    let first = diagnosed(folder, &["--truth", "hidden.toml"], "1");
    let on_rig = ["--embedded", "--rig-file", "rig.toml", "--truth", "hidden.toml"];
    let said = tactus(folder, &[&["--json", "discover", &first, "--active"], &on_rig[..]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    let found = said.json();
    let named = |found: &Value| -> Vec<Value> {
        found["steps"].as_array().unwrap().iter().map(|step| step["effect"].clone()).collect()
    };
    let told =
        format!("{} {} {} {}", found["settled"], found["steps"], found["draft"], found["active_ended"]);
    assert!(
        found["settled"][0].as_str().is_some_and(|one| one.starts_with("draft-1 is confirmed")),
        "{told}"
    );
    assert_eq!(named(&found), ["draft-1"], "{told}");
    let file = fs::read_to_string(folder.join("discovery/draft-1.toml")).unwrap();
    let read = DraftFile::from_toml(&file).unwrap();
    assert_eq!(read.to_toml().unwrap(), file, "reading and writing it changes nothing");
    let draft = &read.draft;
    let is = [stage_name(draft.stage()), draft.carrier.name(), draft.covariates[0].name()];
    assert_eq!(is, [stage, carrier, covariate], "{file}");
    let confirmation = read.confirmation.unwrap();
    assert_eq!((read.status, confirmation.data.len()), (DraftStatus::Confirmed, 1), "{file}");

    let new = diagnosed(folder, &["--truth", "hidden.toml"], "2");
    let without = gap_counts(&new, &diagnosed(folder, &[], "2"));
    let grown = gap_counts(&new, &diagnosed(folder, &["--truth", "discovery/model.toml"], "2"));
    assert!(without.powi(2) > 5.0 * grown.powi(2), "{without} counts without, {grown} with the draft");

    let said = tactus(folder, &["simulate", "--model", "discovery/model.toml", "--scene", "sphere"]);
    assert!(said.code == Some(0) && said.out.contains("effects   draft-1"), "{said:?}");

    // Another rig, with another sensor, has the same physics at another strength.
    let library = ["--library", "drafts"];
    let said = tactus(folder, &[&["effects", "add", "discovery/draft-1.toml"], &library[..]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    let rig = fs::read_to_string(folder.join("rig.toml")).unwrap();
    let other_rig =
        rig.replace("name = \"sim\"", "name = \"other\"").replace("seed = 20100325", "seed = 777");
    assert_eq!(other_rig.matches("other").count() + other_rig.matches("777").count(), 2, "{other_rig}");
    fs::write(folder.join("rig.toml"), other_rig).unwrap();
    let hidden = fs::read_to_string(folder.join("hidden.toml")).unwrap();
    let weaker = hidden.replace(&format!("{strength:?}"), &format!("{:?}", 0.75 * strength));
    fs::write(folder.join("weaker.toml"), weaker).unwrap();
    let other = diagnosed(folder, &["--truth", "weaker.toml"], "3");
    // The library also has a draft of another array, and one that no data show which have no temperature.
    let drafts = folder.join("drafts");
    let foreign = STATED.replace("NAME", "foreign").replace("law =", "weights = [1.0, 2.0]\nlaw =");
    fs::write(drafts.join("foreign.toml"), foreign).unwrap();
    let warm =
        STATED.replace("NAME", "warm").replace("\"depth\"", "\"temperature\"").replace("\"mm\"", "\"C\"");
    fs::write(drafts.join("warm.toml"), warm.replace("[0.0, 0.6]", "[20.0, 30.0]")).unwrap();
    fs::create_dir(folder.join("other")).unwrap();
    fs::write(folder.join("other/draft-7.toml"), "of an earlier result").unwrap();
    let said = tactus(folder, &[&["--json", "discover", &other, "--out", "other"], &library[..]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    let found = said.json();
    assert_eq!(named(&found), ["draft-1"], "{}", found["draft"]);
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("drafts/foreign.toml: draft"), "{warnings}");
    let not_shown = found["not_shown"].as_array().unwrap();
    assert!(not_shown.iter().any(|one| one["effect"] == "warm"), "{not_shown:?}");
    assert!(!folder.join("other/draft-7.toml").exists(), "{:?}", listed(&folder.join("other")));
    let lab: Vec<&Value> = found["lab"].as_array().unwrap().iter().collect();
    let names: Vec<&Value> = lab.iter().map(|one| &one["name"]).collect();
    assert_eq!(names, ["draft-1", "warm"], "{lab:?}");
    let version = &lab[0]["version"];
    let shown = tactus(folder, &[&["--json", "effects", "show", "draft-1"], &library[..]].concat()).json();
    assert_eq!(&shown["version"], version);
    let model = fs::read_to_string(folder.join("other/model.toml")).unwrap();
    assert!(model.contains(&format!("version = {version}")), "{model}");

    fs::write(folder.join("drafts/model.toml"), file.replace("tactus.draft/1", "tactus.model/1")).unwrap();
    let said = tactus(folder, &[&["discover", &other, "--out", "refused"], &library[..]].concat());
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("drafts/model.toml: line 1: schema: this program reads"), "{said:?}");
}

#[test]
fn a_supply_that_sags_is_drafted_confirmed_and_named_on_another_rig() {
    is_drafted_and_confirmed("supply-droop", 2.0, ["element", "own signal", "sum of signals"]);
}

#[test]
fn what_the_motors_couple_in_is_drafted_confirmed_and_named_on_another_rig() {
    is_drafted_and_confirmed("stage-pickup", 1.0, ["readout", "counts", "speed of travel"]);
}

#[test]
#[ignore = "a minute on two processors: `just long-tests`"]
fn a_draft_that_a_new_run_does_not_show_is_refuted_and_the_next_one_has_another_name() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    hide(folder, "supply-droop", 2.0);
    let first = diagnosed(folder, &["--truth", "hidden.toml"], "1");

    // The experiment runs on a rig without the hidden physics.
    let without = ["--active", "--embedded", "--rig-file", "rig.toml", "--out", "refuted"];
    let said = tactus(folder, &[&["discover", &first], &without[..]].concat());
    assert!(said.code == Some(0) && said.out.contains("\ndraft-1 is refuted: in the new run"), "{said:?}");
    assert!(said.out.contains("next: `tactus discover FILES --active` measures draft-2 anew"), "{said:?}");
    let draft_of =
        |path: &str| DraftFile::from_toml(&fs::read_to_string(folder.join(path)).unwrap()).unwrap();
    let refuted = draft_of("refuted/draft-1-refuted.toml");
    assert_eq!((refuted.draft.name.as_str(), refuted.status), ("draft-1", DraftStatus::Refuted));
    assert_eq!(draft_of("refuted/draft-2.toml").draft.name, "draft-2");
    assert!(!folder.join("refuted/draft-1.toml").exists(), "{:?}", listed(&folder.join("refuted")));

    // A draft of the library that no measurement has confirmed is measured anew where it is named.
    let library = ["--library", "drafts"];
    let unconfirmed = DraftFile { status: DraftStatus::Drafted, confirmation: None, ..refuted };
    fs::write(folder.join("draft-1.toml"), unconfirmed.to_toml().unwrap()).unwrap();
    let said = tactus(folder, &[&["effects", "add", "draft-1.toml"], &library[..]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    let active =
        ["--active", "--embedded", "--rig-file", "rig.toml", "--truth", "hidden.toml", "--out", "anew"];
    let said = tactus(folder, &[&["--json", "discover", &first], &active[..], &library[..]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    let told = &said.json()["settled"];
    assert!(told[0].as_str().is_some_and(|one| one.starts_with("draft-1 is confirmed")), "{told}");
    let held =
        DraftFile::from_toml(&fs::read_to_string(folder.join("drafts/draft-1.toml")).unwrap()).unwrap();
    assert_eq!(held.status, DraftStatus::Confirmed, "the library's file says so");

    let confirm = |recording: &str| {
        tactus(folder, &[&["--json", "effects", "confirm", "draft-1", recording], &library[..]].concat())
    };
    let said = confirm(&first);
    assert!(said.code == Some(2) && said.err.is_empty() && said.out.contains("was drafted from"), "{said:?}");
    assert_eq!(confirm(&diagnosed(folder, &[], "5")).json()["status"], "refuted", "there it does not act");
    let again = confirm(&diagnosed(folder, &["--truth", "hidden.toml"], "6")).json();
    assert_eq!((&again["name"], &again["status"]), (&"draft-1".into(), &"confirmed".into()), "{again}");
    assert_eq!(again["file"], "drafts/draft-1.toml");
}

/// `low-pass` and `relaxation` together follow what rings after each stop, and leave little. One curve of the time since a stop follows it better.
#[test]
#[ignore = "a minute on two processors: `just long-tests`"]
fn names_that_one_draft_outdoes_give_way_to_it() {
    let folder = TempDir::new().unwrap();
    let tactus = binary("tactus");
    let set = ["evidence", "run", "--seeds", "tuning", "--campaign", "outside", "--only", "ringing-z100-1"];
    let places = ["--tactus", tactus.to_str().unwrap(), "--work", "work", "--labels", "labels"];
    let ran = computed("tactus-bench", folder.path(), &[&set[..], &places].concat());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let report = fs::read_to_string(folder.path().join("work/reports/outside/ringing-z100-1.json")).unwrap();
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!((&report["verdict"], &report["steps"]), (&"unexplained".into(), &Value::Array(Vec::new())));
    let sentence = report["draft"]["sentence"].as_str().unwrap_or_else(|| panic!("{}", report["draft"]));
    assert!(sentence.contains("time since a start or stop"), "{sentence}");
    let given_up = report["given_up"].as_array().unwrap();
    for name in ["low-pass", "relaxation"] {
        let words = given_up.iter().find(|one| one["effect"] == name).map(|one| &one["because"]);
        assert_eq!(words, Some(&"what is drafted without it explains as much".into()), "{given_up:?}");
    }
}

/// Names of what is in a folder, in order.
fn listed(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|one| one.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Reading waits for the other end of a pipe, so the signal surely comes before the end.
fn interrupted(folder: &Path) -> String {
    let pipe = folder.join("table.parquet");
    mkfifoat(CWD, &pipe, Mode::RUSR | Mode::WUSR).unwrap();
    let run = Process::start("tactus", folder, &["discover", "table.parquet", "--out", "found"]);
    let (told, opened) = mpsc::channel();
    let to_open = pipe.clone();
    let opening = thread::spawn(move || told.send(fs::File::options().write(true).open(to_open)));
    let _writer = opened.recv_timeout(Duration::from_mins(1)).unwrap().unwrap();
    opening.join().unwrap().unwrap();
    let partial = format!("partial-{}", run.id());
    let is_there = [folder.join(format!("found.{partial}")), folder.join("found").join(&partial)];
    assert!(is_there.iter().any(|path| path.is_dir()), "{partial}");
    run.signal(Signal::INT);
    let (code, said) = run.wait();
    assert_eq!(code, Some(130), "{said}");
    fs::remove_file(&pipe).unwrap();
    said
}

#[test]
fn an_interrupted_discovery_leaves_nothing() {
    let folder = TempDir::new().unwrap();
    let said = interrupted(folder.path());
    assert!(listed(folder.path()).is_empty(), "{:?}, {said}", listed(folder.path()));
}

#[test]
fn an_interrupted_discovery_leaves_an_earlier_result_as_it_was() {
    let folder = TempDir::new().unwrap();
    let found = folder.path().join("found");
    fs::create_dir(&found).unwrap();
    fs::write(found.join("report.json"), "earlier").unwrap();
    interrupted(folder.path());
    assert_eq!((listed(folder.path()), listed(&found)), (vec!["found".into()], vec!["report.json".into()]));
    assert_eq!(fs::read_to_string(found.join("report.json")).unwrap(), "earlier");
}

#[test]
fn the_same_data_and_seed_give_the_same_report() {
    let folder = TempDir::new().unwrap();
    hide(folder.path(), "hum-sine", 1.0);
    let recording = diagnosed(folder.path(), &["--truth", "hidden.toml"], "1");
    fs::create_dir(folder.path().join("one")).unwrap();
    fs::write(folder.path().join("one/report.json"), "earlier").unwrap();
    let [one, other] = [("one", "1"), ("other", "2")].map(|(out, threads)| {
        let said = tactus(folder.path(), &["discover", &recording, "--out", out, "--threads", threads]);
        assert_eq!(said.code, Some(0), "{said:?}");
        fs::read(folder.path().join(out).join("report.json")).unwrap()
    });
    assert_eq!(one, other);
    // One folder was there before, with a report; nothing else is left in or beside either.
    let files = ["model.toml", "report.html", "report.json", "residuals.parquet"];
    let left = ["one", "other"].map(|out| listed(&folder.path().join(out)));
    assert!(left.iter().all(|left| *left == files), "{left:?}");
    assert!(
        listed(folder.path()).iter().all(|name| !name.contains("partial")),
        "{:?}",
        listed(folder.path())
    );
}

#[test]
fn a_person_sees_the_share_done_and_a_range_of_the_time_left() {
    let folder = TempDir::new().unwrap();
    hide(folder.path(), "hum-sine", 1.0);
    let recording = diagnosed(folder.path(), &["--truth", "hidden.toml"], "1");
    let mut run = Terminal::start("tactus", folder.path(), &["discover", &recording], [120, 30]);
    run.wait_until(|screen| {
        let bar = screen.lines().find(|line| line.contains("scoring the effects"));
        bar.is_some_and(|line| line.contains(" % ") && line.contains(" to ") && line.contains(" left "))
    });
    run.wait_for(&["report.html"]);
    assert_eq!(run.wait(), Some(0));
}

#[test]
fn nothing_is_missing_of_a_rig_that_hides_nothing() {
    let folder = TempDir::new().unwrap();
    hide(folder.path(), "hum-sine", 1.0);
    let recording = diagnosed(folder.path(), &[], "1");
    let said = tactus(folder.path(), &["--json", "discover", &recording]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(said.json()["verdict"], "nothing-missing", "{}", said.json()["gap"]);
}

#[test]
fn active_says_why_it_runs_nothing() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    hide(folder, "hum-sine", 1.0);
    let recording = diagnosed(folder, &[], "1");
    let active = ["discover", &recording, "--active", "--embedded", "--rig-file", "rig.toml"];
    let said = tactus(folder, &active);
    assert_eq!(said.code, Some(0), "{said:?}");
    let why = "Round 1 of 1 runs nothing: no two explanations are undecided.";
    assert!(said.out.lines().any(|line| line == why), "{said:?}");
    let report: Value =
        serde_json::from_str(&fs::read_to_string(folder.join("discovery/report.json")).unwrap()).unwrap();
    assert_eq!(report["active_ended"], why);
    assert!(!folder.join("discovery/runs").exists());
}

/// The named effects, and those that the data could not distinguish from them.
fn explanations(run: &Value, when: &str) -> Vec<(String, Vec<String>)> {
    let of = |step: &Value| {
        let others =
            step["equivalent"].as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned());
        (step["effect"].as_str().unwrap().to_owned(), others.collect())
    };
    run[when].as_array().unwrap().iter().map(of).collect()
}

#[test]
fn lost_motion_and_hysteresis_are_undecided_by_the_papers_corners_and_decided_by_one_active_round() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    hide(folder, "lost-motion", 0.2);
    let rig = ["--embedded", "--rig-file", "rig.toml", "--truth", "hidden.toml"];
    let corners = ["--json", "run", "corners", "--no-report", "--seed", "3"];
    let said = tactus(folder, &[&corners[..], &rig].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    let recording = said.json()["recording"].as_str().unwrap().to_owned();
    // The lab has a script that fails, and one that goes beyond the envelope.
    fs::create_dir(folder.join("lab")).unwrap();
    for (name, step) in [("failing.star", "fail(\"no sample\")"), ("outside.star", "press(90.0, 5.9, [0.3])")]
    {
        fs::write(folder.join("lab").join(name), format!("def run(rig):\n    {step}\n")).unwrap();
    }
    // The seed draws the held-out presses. Of the seeds 1, 2, 5 and 6, one round decides under 2 and 6.
    let active = [
        "discover",
        &recording,
        "--active",
        "--rounds",
        "1",
        "--budget-min",
        "3",
        "--seed",
        "2",
        "--experiments",
        "lab",
    ];
    let said = tactus(folder, &[&active[..], &rig].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.out.contains("Round 1 of 1:\ntactus run "), "{said:?}");
    assert!(said.out.contains(": to distinguish backlash from hysteresis, by "), "{said:?}");
    let report: Value =
        serde_json::from_str(&fs::read_to_string(folder.join("discovery/report.json")).unwrap()).unwrap();
    let [run] = &report["active"].as_array().unwrap()[..] else { panic!("one run: {}", report["active"]) };
    assert_eq!(explanations(run, "before_equivalent"), [("backlash".into(), vec!["hysteresis".into()])]);
    assert_eq!(explanations(run, "after_equivalent"), [("backlash".into(), vec![])]);
    assert!(run["duration_s"].as_f64().unwrap() < 180.0, "{run}");
    // The run took as long as its rehearsal.
    let told = said.out.lines().find(|line| line.starts_with("tactus run ")).unwrap();
    let [minutes, seconds] = ["min", "s"].map(|unit| {
        let words: Vec<&str> = told.split_whitespace().collect();
        let at = words.iter().position(|word| *word == unit).unwrap_or_else(|| panic!("{told}"));
        words[at - 1].parse::<f64>().unwrap()
    });
    assert!((60.0 * minutes + seconds - run["duration_s"].as_f64().unwrap()).abs() < 1.0, "{told}: {run}");

    // The run is recorded, and all its presses are within the rig's envelope.
    let runs = fs::read_dir(folder.join("discovery/runs")).unwrap();
    let recordings: Vec<_> = runs.map(|run| run.unwrap().path().join("recording.mcap")).collect();
    let rig: toml::Table = toml::from_str(&fs::read_to_string(folder.join("rig.toml")).unwrap()).unwrap();
    let within = |axis: &str, mm: f64| {
        let [least, most] = [0, 1].map(|end| rig["envelope"][axis][end].as_float().unwrap());
        (least..=most).contains(&mm)
    };
    let of = |table: &str, key: &str| rig[table][key].as_float().unwrap();
    let deepest_mm = of("envelope", "depth_share_max") * of("covering", "thickness_mm");
    let mut frames = 0;
    rows::visit(&recordings.iter().map(PathBuf::as_path).collect::<Vec<_>>(), |_, row| {
        let [x_mm, y_mm, z_mm] = row.position_mm;
        if z_mm >= 0.0 {
            return;
        }
        frames += 1;
        assert!(within("x_mm", x_mm) && within("y_mm", y_mm) && z_mm >= -deepest_mm, "{:?}", row.position_mm);
    })
    .unwrap();
    assert!(frames > 300, "{frames}");
}

/// Data of a real device: a soft magnetic skin, pressed at one place (`../shared/data`). Other held-out presses must not contradict.
#[test]
fn a_measured_run_names_hardening_and_a_loop_with_its_causes() {
    let data = repository("../shared/data/eflesh-normal-20250401_014340.parquet");
    if !data.is_file() {
        eprintln!("skipped: {} is not here", data.display());
        return;
    }
    let report = reported(&[data.to_str().unwrap()]);
    assert_eq!(report["verdict"], "partly-explained");
    let depends_on = report["unexplained"]["depends_on"].as_array().unwrap();
    assert!(depends_on.contains(&"element and depth".into()), "{depends_on:?}");
    let left = &report["final"]["structured"];
    assert!(left["rms_noise"].as_f64().unwrap() > 5.0, "{left}");
    let slots = slots(&report);
    // Ten strokes at one speed do not tell what makes the loop.
    assert_eq!((slots.len(), &*slots[0][0]), (2, "hardening"), "{slots:?}");
    assert!(slots[1].contains(&"hysteresis".to_owned()) && slots[1].len() > 1, "{slots:?}");
}

/// The same data as two runs of five strokes each, of which the second was made after the rig was calibrated again and renamed: its
/// zeros lie elsewhere, and all channels are 2 % more sensitive.
#[test]
#[ignore = "a minute on two processors: `just long-tests`"]
fn two_parts_of_a_measured_run_do_not_contradict_each_other() {
    let data = repository("../shared/data/eflesh-normal-20250401_014340.parquet");
    if !data.is_file() {
        eprintln!("skipped: {} is not here", data.display());
        return;
    }
    let folder = TempDir::new().unwrap();
    let (mut rows, mut press) = (Vec::new(), 0);
    let source = rows::visit(&[&data], |_, row| {
        press = press.max(row.press);
        rows.push((press >= 5, Row::from(row)));
    });
    let rig = source.unwrap().rig;
    let zeros = rows[0].1.counts.clone();
    let part = |name: &str, is_later: bool| {
        let mut rig = rig.clone();
        let changed = |row: &Row| {
            let gained = |(counts, zero): (&f32, &f32)| (counts + 40.0 + 0.02 * (counts - zero)).round();
            let of_later = || row.counts.iter().zip(&zeros).map(gained).collect();
            let counts = if is_later { of_later() } else { row.counts.clone() };
            Row { run: name.to_owned(), counts, ..row.clone() }
        };
        let of_part: Vec<Row> =
            rows.iter().filter(|(later, _)| *later == is_later).map(|(_, row)| changed(row)).collect();
        name.clone_into(&mut rig.name);
        if is_later {
            rig.baseline_counts.iter_mut().for_each(|counts| *counts += 40.0);
            rig.sensitivity_counts_per_mm.iter_mut().for_each(|gain| *gain *= 1.02);
        }
        let path = folder.path().join(name);
        let mut table = TableWriter::create(&path, &rig.to_json()).unwrap();
        for row in &of_part {
            table.push(row.into()).unwrap();
        }
        table.finish().unwrap();
        path.to_str().unwrap().to_owned()
    };
    let [one, other] = [part("first", false), part("second", true)];
    let together = reported(&[&one, &other]);
    let warnings = together["warnings"].to_string();
    assert!(warnings.contains("first") && warnings.contains("second"), "{warnings}");
    let slots = slots(&together);
    assert_eq!((slots.len(), &*slots[0][0]), (2, "hardening"), "{slots:?}");
    assert!(slots[1].contains(&"hysteresis".to_owned()) && slots[1].len() > 1, "{slots:?}");
    // Alone, with four fitted strokes and one held out, it names less or the same.
    for set in self::slots(&reported(&[&one])) {
        let meets = slots.iter().any(|slot| slot.iter().any(|name| set.contains(name)));
        assert!(meets, "{set:?} is in no set of {slots:?}");
    }
}

/// What `tactus discover` reports on files.
fn reported(files: &[&str]) -> Value {
    let folder = TempDir::new().unwrap();
    let said = tactus(folder.path(), &[&["discover"], files].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    serde_json::from_slice(&fs::read(folder.path().join("discovery/report.json")).unwrap()).unwrap()
}

/// For each added effect, the set of effects that the data cannot tell apart in its place, itself first.
fn slots(report: &Value) -> Vec<Vec<String>> {
    let name = |value: &Value| value.as_str().unwrap().to_owned();
    let slot = |step: &Value| {
        let others = step["equivalent"].as_array().unwrap().iter().map(name);
        std::iter::once(name(&step["effect"])).chain(others).collect()
    };
    report["steps"].as_array().unwrap().iter().map(slot).collect()
}
