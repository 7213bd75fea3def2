//! `tactus design`: which covering to order, with numbers that can be checked by hand; refused requests.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use serde_json::Value;
use tactus_e2e::{repository, tactus};
use tempfile::TempDir;

fn design(folder: &Path, args: &[&str]) -> Value {
    let said = tactus(folder, &[&["--json", "design"], args].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    said.json()
}

#[track_caller]
fn assert_near(value: &Value, want: f64, within: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - want).abs() <= within, "{value}, not {want}");
}

#[test]
fn the_papers_sensor_gets_the_papers_thinnest_covering() {
    let folder = TempDir::new().unwrap();
    let told = design(folder.path(), &["--pitch-mm", "2", "--force-steps", "256", "--out", "curve.svg"]);
    // Eq. 4 inverted at 3 / pi: below any covering.
    assert_near(&told["nyquist_sigma"], 0.955, 5e-4);
    assert_near(&told["wanted_thickness_mm"], -0.624, 1e-3);
    assert_eq!(told["reason"], "sensor_already_wider");
    let covered = &told["recommended"];
    assert_near(&covered["thickness_mm"], 1.016, 1e-9);
    assert_near(&covered["sigma"], 1.362, 5e-4);
    // exp(-2 (pi 1.362 / 2)^2)
    assert_near(&covered["nyquist_passed"], 1.05e-4, 1e-6);
    assert_eq!(covered["locations"], 117);
    assert!(told["notes"][0].as_str().unwrap().contains("the sensor alone has 1.11"), "{}", told["notes"]);
    // The optimum of Fig. 6a for 256 whole steps.
    assert_near(&told["best_for_locating"]["sigma"], 0.26, 1e-9);
    assert_eq!(told["best_for_locating"]["locations"], 485);
    assert_near(&told["best_for_two_points"]["sigma"], 0.3, 0.1);
    assert_near(&told["force_resolution"], 1.0 / 256.0, 1e-15);
    let curve = told["curve"].as_array().unwrap();
    let papers: Vec<_> = curve.iter().filter(|covered| covered["of_the_paper"] == true).collect();
    assert_eq!((curve.len(), papers.len()), (16, 4));
    for (covered, sigma) in papers.iter().zip([1.36, 1.74, 1.99, 2.37]) {
        assert_near(&covered["sigma"], sigma, 0.005);
    }
    let drawn = fs::read_to_string(folder.path().join("curve.svg")).unwrap();
    assert!(drawn.starts_with("<svg") && drawn.contains("recommended"));
}

#[test]
fn a_measured_model_gives_pitch_and_spread() {
    let folder = TempDir::new().unwrap();
    let model = repository("config/models/digitacts.toml").display().to_string();
    let own = design(folder.path(), &["--force-steps", "100", "--model", &model]);
    let paper = design(folder.path(), &["--force-steps", "100", "--pitch-mm", "2"]);
    assert_eq!(own["recommended"], paper["recommended"], "the shipped model is the paper's");
    assert_eq!(own["best_for_locating"]["locations"], 189);

    let text = fs::read_to_string(&model).unwrap();
    let text = text.replace("sigma_intercept_mm = 2.22", "sigma_intercept_mm = 1.0");
    fs::write(folder.path().join("sharp.toml"), text).unwrap();
    let args = ["--force-steps", "256", "--model", "sharp.toml", "--out", "curve.html"];
    let told = design(folder.path(), &args);
    // (2 x 0.955 - 1.0) / 0.497 mm, rounded up to hundredths.
    assert_eq!(told["reason"], "gives_wanted");
    assert_near(&told["recommended"]["thickness_mm"], 1.84, 1e-9);
    assert_near(&told["recommended"]["nyquist_passed"], (-4.5_f64).exp(), 3e-4);
    assert!(told["notes"][0].as_str().unwrap().contains("2.540 mm comes next"), "{}", told["notes"]);
    let page = fs::read_to_string(folder.path().join("curve.html")).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("<svg"));
}

#[test]
fn a_person_reads_the_choice_its_reason_and_a_table() {
    let folder = TempDir::new().unwrap();
    let said =
        tactus(folder.path(), &["design", "--pitch-mm", "2", "--force-steps", "256", "--min-sigma", "1.5"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    for words in
        ["1.570 mm", "thinnest covering that gives the wanted spread", "thickness mm", "without noise"]
    {
        assert!(said.out.contains(words), "{words}: {}", said.out);
    }
}

#[test]
fn bad_numbers_are_refused_with_what_to_do() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("model.toml"), "schema = \"tactus.model/1\"\n[base]\nnoise = 1\n").unwrap();
    for (args, word) in [
        (&["--pitch-mm", "2"][..], "--force-steps"),
        (&["--force-steps", "256", "--pitch-mm", "0"], "0.05 to 100 mm"),
        (&["--force-steps", "256", "--pitch-mm", "-2"], "0.05 to 100 mm"),
        (&["--force-steps", "256", "--pitch-mm", "nan"], "0.05 to 100 mm"),
        (&["--force-steps", "1"], "2 to 65536"),
        (&["--force-steps", "1000000"], "2 to 65536"),
        (&["--force-steps", "2.5"], "invalid"),
        (&["--force-steps", "256", "--min-sigma", "0"], "0.05 to 10 pitches"),
        (&["--force-steps", "256", "--min-sigma", "inf"], "0.05 to 10 pitches"),
        (&["--force-steps", "256", "--model", "model.toml"], "noise"),
        (&["--force-steps", "256", "--model", "missing.toml"], "missing.toml"),
        (&["--force-steps", "256", "--out", "curve.png"], ".svg or .html"),
        (&["--force-steps", "256", "--out", "no/folder/curve.svg"], "cannot be written"),
    ] {
        let said = tactus(folder.path(), &[&["design"], args].concat());
        assert!(matches!(said.code, Some(1 | 2)), "{args:?}: {said:?}");
        assert!(said.err.contains(word) && !said.err.contains("panicked"), "{args:?}: {}", said.err);
    }
}
