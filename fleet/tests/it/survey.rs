//! Calibration and discovery of all runs: what drifts, what is shared, what is kept.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use serde_json::Value;

use crate::lab::{DAY_NS, Lab, NOON_NS};

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
    // A result that is missing or cut off is made again.
    let result = lab.path("survey/calibration/rig=left/date=2026-03-25/20260325-120000-left.json");
    fs::write(&result, "{").unwrap();
    assert_eq!(survey(&lab, "calibrate")["runs_analysed"], 1);
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
