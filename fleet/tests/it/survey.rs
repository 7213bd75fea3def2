//! Calibration and discovery of all runs: what drifts, what is shared, what is kept.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use rustix::process::Signal;
use serde_json::Value;
use tactus_e2e::{Process, files, until};

use crate::lab::{DAY_NS, Lab, NOON_NS};
use crate::synthetic::Plan;

/// Runs of two rigs on several days; the sensitivity of `left` falls by 1 % a day.
fn drifting() -> Lab {
    let lab = Lab::new();
    for day in 0..5_u8 {
        let at_ns = NOON_NS + i64::from(day) * DAY_NS;
        let id = |rig: &str| format!("2026032{}-120000-{rig}", 5 + day);
        lab.record_with_gain("left", &id("left"), at_ns, 48, 1.0 - 0.01 * f64::from(day));
        lab.record_with_gain("right", &id("right"), at_ns, 48, 1.0);
    }
    lab.ingest();
    lab
}

fn survey(lab: &Lab, command: &str) -> Value {
    let said = lab.fleet(&["--json", command, "--out", "survey"]);
    assert!(matches!(said.code, Some(0 | 3)), "{said:?}");
    said.json()
}

#[test]
fn the_sensor_that_drifts_is_found_and_what_was_done_is_kept() {
    let lab = drifting();
    let told = survey(&lab, "calibrate");
    assert_eq!(
        (&told["runs_analysed"], &told["rigs"], &told["simulated"]),
        (&10.into(), &2.into(), &true.into())
    );
    let changing: Vec<_> =
        told["drifts"].as_array().unwrap().iter().filter(|trend| trend["changes"] == true).collect();
    let of = |trend: &Value| (trend["rig"].clone(), trend["quantity"].clone());
    assert_eq!(
        changing.iter().map(|trend| of(trend)).collect::<Vec<_>>(),
        [("left".into(), "sensitivity".into())],
        "{told}"
    );
    let slope = &changing[0]["slope"];
    let share = slope["per_day"].as_f64().unwrap() / slope["start"].as_f64().unwrap();
    assert!((share + 0.01).abs() < 0.002, "{slope}");
    let page = fs::read_to_string(lab.path("survey/report.html")).unwrap();
    assert!(page.contains("Rig left: sensitivity") && page.contains("SIMULATED") && page.contains("<svg"));

    let again = survey(&lab, "calibrate");
    assert_eq!((&again["runs_analysed"], &again["runs_kept"]), (&0.into(), &10.into()));
    assert_eq!(again["drifts"], told["drifts"]);
    // A result that is cut off, or of another version of the program, is made again.
    let result = lab.path("survey/calibration/rig=left/date=2026-03-25/20260325-120000-left.json");
    let made = fs::read_to_string(&result).unwrap();
    let version = format!("\"version\": \"{}\"", env!("CARGO_PKG_VERSION"));
    let of_another = made.replace(&version, "\"version\": \"0.0.1\"");
    assert_ne!(of_another, made);
    for damaged in ["{", &of_another] {
        fs::write(&result, damaged).unwrap();
        assert_eq!(survey(&lab, "calibrate")["runs_analysed"], 1);
        assert_eq!(fs::read_to_string(&result).unwrap(), made);
    }
}

#[test]
fn runs_that_show_nothing_are_told_and_not_searched_again() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let told = survey(&lab, "discover");
    assert_eq!(told["runs_analysed"], 3);
    let again = survey(&lab, "discover");
    assert_eq!((&again["runs_analysed"], &again["refused"]), (&0.into(), &told["refused"]));
}

#[test]
fn files_that_cannot_be_read_stop_no_survey_and_are_tried_again() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let [cut, flawed] = [0, 1].map(|file| lab.path("fleet").join(&lab.files()[file]));
    let whole = fs::read(&cut).unwrap();
    fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    // What the end of the file says is in order; the rows are not.
    let mut rows = fs::read(&flawed).unwrap();
    rows[4..2000].fill(0);
    fs::write(&flawed, rows).unwrap();
    let said = lab.fleet(&["--json", "calibrate", "--out", "survey"]);
    assert_eq!(said.code, Some(3), "{said:?}");
    let told = said.json();
    let refused: Vec<_> =
        told["refused"].as_array().unwrap().iter().map(|run| run.as_str().unwrap()).collect();
    assert_eq!(refused.len(), 2, "{told}");
    assert!(refused[0].starts_with("20260325-120000-image of rig left: "), "{told}");
    assert!(refused[1].starts_with("20260325-120000-centres of rig right: "), "{told}");
    assert!(lab.path("survey/report.html").exists());

    fs::write(&cut, whole).unwrap();
    let again = survey(&lab, "calibrate");
    assert_eq!((&again["runs_analysed"], &again["runs_kept"]), (&1.into(), &2.into()), "{again}");
}

#[test]
fn a_run_that_changed_within_its_size_is_analysed_again() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    survey(&lab, "calibrate");
    let file = lab.path("fleet").join(&lab.files()[0]);
    let mut changed = fs::read(&file).unwrap();
    let at = changed.windows(11).rposition(|text| text == b"\"who\":\"ada\"").unwrap();
    changed[at..at + 11].copy_from_slice(b"\"who\":\"eva\"");
    fs::write(&file, changed).unwrap();
    let told = survey(&lab, "calibrate");
    assert_eq!((&told["runs_analysed"], &told["runs_kept"]), (&1.into(), &2.into()));
}

#[test]
fn a_report_says_how_many_runs_each_analysis_has_seen() {
    let lab = Lab::with_three_runs();
    lab.ingest();
    let said = lab.fleet(&["calibrate", "--out", "survey"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    for line in ["calibrated   3 of 3 runs", "searched     0 of 3 runs", "shared       not searched"] {
        assert!(said.out.lines().any(|told| told == line), "{line}: {said:?}");
    }
    // A run changes: what the search found in it does not count any more.
    survey(&lab, "discover");
    fs::remove_dir_all(lab.path("runs/20260325-120000-image")).unwrap();
    lab.record("left", "20260325-120000-image", NOON_NS, 3);
    lab.ingest();
    let told = survey(&lab, "calibrate");
    let counts =
        ["runs_in_fleet", "runs_calibrated", "runs_searched"].map(|name| told[name].as_u64().unwrap());
    assert_eq!(counts, [3, 3, 2], "{told}");
    let left =
        told["refused"].as_array().unwrap().iter().filter(|run| run.as_str().unwrap().contains("left"));
    assert_eq!(left.count(), 0, "{told}");
}

#[test]
fn a_collection_whose_frames_are_in_a_run_is_left_out() {
    let lab = Lab::with_three_runs();
    lab.collect("left", "20260325-120001-left", NOON_NS + 1_000_000_000);
    lab.collect("right", "20260325-130000-right", NOON_NS + 3_600_000_000_000);
    let said = lab.fleet(&["ingest", "runs", "--to", "fleet"]);
    assert_eq!(said.code, Some(3), "{said:?}");
    let told = survey(&lab, "calibrate");
    let counts = ["runs_analysed", "runs_left_out", "runs_in_fleet"].map(|name| told[name].as_u64().unwrap());
    assert_eq!(counts, [4, 1, 5], "{told}");
}

#[test]
fn an_effect_that_two_of_three_rigs_have_is_found_in_their_recordings_and_told_as_shared() {
    let lab = Lab::new();
    // In a synthetic run two elements answer for others, unless it is planned without.
    for (rig, is_miswired) in [("left", true), ("right", true), ("far", false)] {
        let mut plan = Plan { run_id: format!("20260325-120000-{rig}"), ..Plan::short(24) };
        if !is_miswired {
            plan.miswired.clear();
        }
        lab.record_plan(rig, plan, NOON_NS, 1.0);
    }
    lab.ingest();
    let told = survey(&lab, "discover");
    assert_eq!(told["runs_analysed"], 3, "{told}");
    let effects = told["effects"].as_array().unwrap();
    let miswired = effects.iter().find(|missing| missing["effect"] == "miswired").unwrap();
    let rigs = miswired["rigs"].as_array().unwrap();
    let mut rigs: Vec<_> = rigs.iter().map(|at| at["rig"].as_str().unwrap()).collect();
    rigs.sort_unstable();
    assert_eq!((rigs, &miswired["shared"]), (vec!["left", "right"], &true.into()), "{told}");
    let page = fs::read_to_string(lab.path("survey/report.html")).unwrap();
    assert!(page.contains("miswired"), "{page}");
}

/// A worker that calibrates one run after the other.
fn worker(lab: &Lab, more: &[&str]) -> Process {
    let calibrate = ["--json", "--threads", "1", "calibrate", "--out", "shared"];
    Process::start("tactus-fleet", &lab.path(""), &[&calibrate[..], more].concat())
}

/// Claims, as names of runs with the numbers of the claims.
fn claims(lab: &Lab) -> Vec<String> {
    files(&lab.path("shared/claims")).into_keys().map(|path| path.display().to_string()).collect()
}

/// Holds a worker while it has a run that is not done.
fn hold_at_work(worker: &Process, lab: &Lab) {
    let is_at_work = || {
        let result = |claim: &String| lab.path("shared").join(claim.replace(".parquet.0", ".json"));
        claims(lab).first().is_some_and(|claim| !result(claim).exists())
    };
    worker.hold_when("a worker that is held while it has a run", is_at_work);
}

fn told(worker: Process) -> Value {
    let (code, said) = worker.wait();
    assert_eq!(code, Some(0), "{said}");
    serde_json::from_str(&said).unwrap()
}

#[test]
fn two_workers_share_the_runs_and_find_what_one_finds() {
    let lab = drifting();
    let alone = survey(&lab, "calibrate");
    let args = ["--lease-s", "3600"];
    let first = worker(&lab, &args);
    hold_at_work(&first, &lab);
    let second = worker(&lab, &args);
    until("all runs but one", || (files(&lab.path("shared/calibration")).len() == 9).then_some(()));
    first.signal(Signal::CONT);
    let [first, second] = [first, second].map(told);
    let of = |told: &Value| {
        ["runs_analysed", "runs_by_others", "runs_kept"].map(|name| told[name].as_u64().unwrap())
    };
    assert!(of(&first)[0] >= 1 && of(&second)[0] >= 1, "{first} {second}");
    // Each run was done once.
    assert_eq!(of(&first)[0] + of(&second)[0], 10);
    for told in [&first, &second] {
        assert_eq!(of(told).iter().sum::<u64>(), 10);
        assert_eq!(told["drifts"], alone["drifts"]);
    }
    assert_eq!(files(&lab.path("shared/calibration")), files(&lab.path("survey/calibration")));
    assert!(claims(&lab).is_empty());
}

#[test]
fn the_run_of_a_killed_worker_is_taken_over() {
    let lab = drifting();
    survey(&lab, "calibrate");
    let args = ["--lease-s", "1"];
    let mut first = worker(&lab, &args);
    hold_at_work(&first, &lab);
    first.kill();
    let done = files(&lab.path("shared/calibration")).len();
    let second = told(worker(&lab, &args));
    assert_eq!((&second["runs_analysed"], &second["runs_kept"]), (&(10 - done).into(), &done.into()));
    assert_eq!(files(&lab.path("shared/calibration")), files(&lab.path("survey/calibration")));
    assert!(claims(&lab).is_empty());
}

#[test]
fn a_stopped_survey_leaves_nothing_half_done_and_the_next_goes_on() {
    let lab = drifting();
    survey(&lab, "calibrate");
    let first = worker(&lab, &[]);
    hold_at_work(&first, &lab);
    first.signal(Signal::TERM);
    first.signal(Signal::CONT);
    let (code, said) = first.wait();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("not done: the same command goes on"), "{said}");
    assert!(claims(&lab).is_empty());
    let done = files(&lab.path("shared/calibration"));
    assert!(
        done.keys().all(|path| path.extension().is_some_and(|extension| extension == "json")),
        "{done:?}"
    );
    let second = told(worker(&lab, &[]));
    assert_eq!(second["runs_kept"], done.len());
    assert_eq!(files(&lab.path("shared/calibration")), files(&lab.path("survey/calibration")));
}
