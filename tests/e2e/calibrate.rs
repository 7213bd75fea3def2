//! Calibration and the study on the command line: their results, and incomplete data.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tactus_e2e::{CommandOutput, repository, tactus};
use tempfile::TempDir;

fn run(folder: &Path, experiment: &str, parameters: &[&str]) -> PathBuf {
    let mut args = vec!["--json", "run", experiment, "--embedded", "--no-report", "--seed", "7"];
    args.extend(parameters.iter().flat_map(|parameter| ["-p", *parameter]));
    let said = tactus(folder, &args);
    assert_eq!(said.code, Some(0), "{said:?}");
    folder.join(said.json()["recording"].as_str().unwrap())
}

fn calibrate(folder: &Path, files: &[&Path]) -> CommandOutput {
    let mut args = vec!["--json", "calibrate", "--out", "found"];
    args.extend(files.iter().map(|path| path.to_str().unwrap()));
    tactus(folder, &args)
}

fn sentences(found: &Value, list: &str) -> String {
    let sentences = found[list].as_array().unwrap().iter().map(|sentence| sentence.as_str().unwrap());
    sentences.collect::<Vec<_>>().join("\n")
}

#[test]
fn a_calibrated_model_goes_into_the_simulator() {
    let folder = TempDir::new().unwrap();
    let corners = run(folder.path(), "corners", &[]);
    let centres = run(folder.path(), "element-centres", &[]);
    let sweep = run(folder.path(), "grid-sweep", &["points=5", "spacing_mm=0.35"]);
    let said = calibrate(folder.path(), &[&corners, &centres, &sweep]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let found = said.json();
    assert_eq!((&found["schema"], &found["simulated"]), (&"tactus.calibration/1".into(), &true.into()));
    assert_eq!(found["spreads"].as_array().unwrap().len(), 12, "four coverings, three depths");
    let written = fs::read_to_string(folder.path().join("found/calibration.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&written).unwrap(), found);

    let said = tactus(folder.path(), &["validate", "found/model.toml"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    // The faulty elements are in the model: element 18 gives the signal of 19, with its own gain.
    let press = ["--scene", "cylinder", "--x-mm", "7.1", "--y-mm", "4.9", "--depth-mm", "0.5"];
    let image = |model: &[&str]| {
        let said = tactus(folder.path(), &[&["--json", "simulate"], &press[..], model].concat());
        assert_eq!(said.code, Some(0), "{said:?}");
        let row = said.json()["image"][2].clone();
        [row[2].as_f64().unwrap(), row[3].as_f64().unwrap()]
    };
    let [crossed, own] = image(&["--model", "found/model.toml"]);
    // Their gains differ by 16 %; a neighbour without the fault would read 0.77.
    assert!(((crossed - 100.0) / (own - 100.0) - 0.84).abs() < 0.01, "{crossed} {own}");
    let [neighbour, own] = image(&[]);
    assert!(((neighbour - 100.0) / (own - 100.0) - 0.77).abs() < 0.01, "{neighbour} {own}");

    let page = fs::read_to_string(folder.path().join("found/report.html")).unwrap();
    assert!(page.contains("SIMULATED") && page.contains("Figure 5a") && !page.contains("src=\"http"));
}

#[test]
fn a_table_gives_what_its_recordings_give() {
    let folder = TempDir::new().unwrap();
    let centres = run(folder.path(), "element-centres", &[]);
    let table = folder.path().join("table.parquet");
    let said =
        tactus(folder.path(), &["export", centres.to_str().unwrap(), "--out", table.to_str().unwrap()]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let [mut of_recording, mut of_table] =
        [&centres, &table].map(|path| calibrate(folder.path(), &[path]).json());
    for found in [&mut of_recording, &mut of_table] {
        found.as_object_mut().unwrap().remove("files");
    }
    assert_eq!(of_recording, of_table);
}

#[test]
fn one_covering_gives_what_it_can_and_says_what_it_cannot() {
    let folder = TempDir::new().unwrap();
    let centres = run(folder.path(), "element-centres", &[]);
    let said = calibrate(folder.path(), &[&centres]);
    assert_eq!(said.code, Some(3), "{said:?}");
    let found = said.json();
    let missing = sentences(&found, "missing");
    assert!(missing.contains("one covering"), "{missing}");
    assert!(found["thickness"]["linear"].is_null());
    // Eq. 4 at the thinnest covering.
    let sigma_mm = found["thickness"]["coverings"][0]["sigma_mm"]["value"].as_f64().unwrap();
    assert!((sigma_mm - 2.725).abs() < 0.02, "{sigma_mm}");
}

#[test]
fn a_recording_that_was_cut_off_still_counts() {
    let folder = TempDir::new().unwrap();
    let centres = run(folder.path(), "element-centres", &[]);
    let bytes = fs::read(&centres).unwrap();
    let cut = folder.path().join("cut.mcap");
    fs::write(&cut, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let said = calibrate(folder.path(), &[&cut]);
    assert_eq!(said.code, Some(3), "{said:?}");
    let found = said.json();
    assert!(sentences(&found, "notes").contains("readable up to byte"), "{found}");
    let elements = found["response"]["elements"].as_array().unwrap().len();
    assert!((10..46).contains(&elements), "{elements} of 46 sound elements were pressed before the cut");
    assert!(sentences(&found, "missing").contains("not pressed at their centres"), "{found}");
}

#[test]
fn what_is_no_measurement_is_refused() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("notes.txt");
    fs::write(&file, "not measured").unwrap();
    let said = calibrate(folder.path(), &[&file]);
    assert_eq!(said.code, Some(1), "{said:?}");
    assert!(said.json()["error"].as_str().unwrap().contains("notes.txt"), "{said:?}");
    assert!(!folder.path().join("found").exists());
}

/// Data of a real device: a soft magnetic skin, pressed at one place (`../shared/data`).
#[test]
fn measured_data_of_another_sensor_give_no_number_without_a_warning() {
    let data = repository("../shared/data/eflesh-normal-20250401_014340.parquet");
    if !data.is_file() {
        eprintln!("skipped: {} is not here", data.display());
        return;
    }
    let folder = TempDir::new().unwrap();
    let said = calibrate(folder.path(), &[&data]);
    assert_eq!(said.code, Some(3), "{said:?}");
    let found = said.json();
    assert_eq!(found["simulated"], false);
    assert!(found["registration"].is_null() && found["thickness"].is_null(), "one place tells neither");
    let missing = sentences(&found, "missing");
    assert!(missing.contains("Registration") && missing.contains("Point spread"), "{missing}");
    let warnings = sentences(&found, "warnings");
    assert!(warnings.contains("nominal") && warnings.contains("times the noise"), "{warnings}");
    // Some channels grow with the square of the depth: two of their parameters mean little by themselves.
    assert!(warnings.contains("begin flat"), "{warnings}");
    assert!(found["health"]["faults"].as_array().unwrap().is_empty(), "{found}");
    // Sensitivities have both signs, as in the data's description.
    let elements = found["response"]["elements"].as_array().unwrap();
    let negative = elements.iter().filter(|one| one["linear_counts_per_mm"]["value"].as_f64().unwrap() < 0.0);
    assert_eq!((elements.len(), negative.count()), (15, 3));
}

#[test]
fn a_study_makes_every_run_once_and_one_report() {
    let folder = TempDir::new().unwrap();
    let study = |more: &[&str]| {
        tactus(
            folder.path(),
            &[&["--json", "study", "--embedded", "--points", "3", "--out", "study"], more].concat(),
        )
    };
    let said = study(&[]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let found = said.json();
    assert!(found["truths"].as_u64().unwrap() >= 12, "{found}");
    let runs = || fs::read_dir(folder.path().join("study/runs")).unwrap().count();
    // Corners, centres, a sweep per covering, the H at six angles and under each covering.
    assert_eq!(runs(), 13);
    let page = fs::read_to_string(folder.path().join("study/report.html")).unwrap();
    for figure in ["2a", "2b", "3", "4", "5a", "5b", "6a", "6b", "8a", "8b", "9b", "10a", "10b"] {
        assert!(page.contains(&format!("Figure {figure}")), "{figure}");
    }
    // As after an interruption: only missing runs are made.
    let state = folder.path().join("study/study.json");
    let mut steps: Value = serde_json::from_str(&fs::read_to_string(&state).unwrap()).unwrap();
    steps["taken"].as_array_mut().unwrap().truncate(11);
    fs::write(&state, steps.to_string()).unwrap();
    assert_eq!(study(&[]).code, Some(0));
    assert_eq!(runs(), 13 + 2);
    let said = study(&["--seed", "2"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.json()["error"].as_str().unwrap().contains("another seed"), "{said:?}");
}
