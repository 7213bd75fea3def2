//! The README's first command, and its promises.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use serde_json::Value;
use tactus_e2e::{Terminal, repository, tactus};
use tactus_record::{Entry, Message, rows};
use tactus_runner::embedded::SIMULATED_RIG;
use tactus_schema::WallTime;
use tempfile::TempDir;

const TWO_PRESSES: &str = r#"
"""Two presses."""
def run(rig):
    tare()
    for element in [rig.elements[20], rig.elements[27]]:
        press(element.x_mm, element.y_mm, depths_mm = [0.2, 0.4])
"#;

fn run(folder: &Path, args: &[&str]) -> Value {
    let said = tactus(folder, &[&["--json", "run", "--embedded"], args].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    said.json()
}

#[test]
fn element_centres_presses_all_elements_and_ends_with_a_recording_and_a_report() {
    let folder = TempDir::new().unwrap();
    let summary = run(folder.path(), &["element-centres", "--seed", "7"]);
    for (key, value) in [
        ("experiment", "element-centres".into()),
        ("exit_status", "done".into()),
        ("presses", 48.into()),
        ("dwells", 240.into()),
        ("frames_lost", 0.into()),
        ("simulated", true.into()),
    ] as [(&str, Value); 6]
    {
        assert_eq!(summary[key], value, "{key}");
    }
    let report = fs::read_to_string(summary["report"].as_str().unwrap()).unwrap();
    assert!(report.contains("SIMULATED"));
    assert!(
        !report.contains("src=\"http") && !report.contains("href=\"http"),
        "the report must be self-contained"
    );
    let info =
        tactus(folder.path(), &["--json", "record", "info", summary["recording"].as_str().unwrap()]).json();
    assert_eq!((&info["frames"], &info["run_id"]), (&summary["frames"], &summary["run_id"]));
}

#[test]
fn the_first_line_says_that_it_is_simulated() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("two.star"), TWO_PRESSES).unwrap();
    let said = tactus(folder.path(), &["run", "two.star", "--embedded", "--no-report"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let first = said.out.lines().next().unwrap();
    assert!(first.contains("SIMULATED") && first.contains("embedded"), "{first}");
}

#[test]
fn a_service_that_is_named_and_dead_is_an_error_and_nothing_is_simulated() {
    let folder = TempDir::new().unwrap();
    let dead = "tcp/127.0.0.1:1";
    for command in [
        &["run", "corners"][..],
        &["plan", "corners"],
        &["study"],
        &["discover", "--active"],
        &["run", "--continue", "20260101-000000-corners-0000"],
    ] {
        let said = tactus(folder.path(), &[&["--endpoint", dead], command].concat());
        assert_eq!(said.code, Some(1), "{said:?}");
        let says = said.err.contains(&format!("no service at {dead}")) && said.err.contains("--embedded");
        assert!(says && !said.out.contains("SIMULATED"), "{said:?}");
    }
    assert!(!folder.path().join("runs").exists());
    let said = tactus(folder.path(), &["--endpoint", dead, "plan", "corners", "--embedded"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.out.contains("embedded, as asked"), "{said:?}");
}

#[test]
fn two_runs_with_one_seed_are_identical_and_another_seed_differs() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("two.star"), TWO_PRESSES).unwrap();
    let record = |seed: &str| {
        let summary = run(folder.path(), &["two.star", "--seed", seed, "--no-report"]);
        messages(Path::new(summary["recording"].as_str().unwrap()))
    };
    let (first, again, other) = (record("1"), record("1"), record("2"));
    assert!(first.len() > 100);
    for (index, (one, two)) in first.iter().zip(&again).enumerate() {
        assert_eq!(one, two, "message {index}");
    }
    assert_eq!(first.len(), again.len());
    assert_ne!(first, other);
}

/// Every message without the run's name and the wall clock, which always differ.
fn messages(recording: &Path) -> Vec<String> {
    tactus_record::read(recording)
        .unwrap()
        .filter_map(|entry| match entry.unwrap() {
            Entry::Message { message, .. } => Some(without_wall_clock(message)),
            Entry::Run(_) | Entry::Attachment(_) => None,
        })
        .collect()
}

fn without_wall_clock(mut message: Message) -> String {
    match &mut message {
        Message::Frame(frame) => frame.received.wall = WallTime::default(),
        Message::Stage(state) => state.t_wall_ns = 0,
        Message::Event(event) => {
            event.t_wall_ns = 0;
            event.run_id.clear();
        }
        Message::Safety(event) => event.t_wall_ns = 0,
        Message::SensorInfo(_) | Message::Unknown(_) => {}
    }
    format!("{message:?}")
}

/// A rig that hides nothing but its stage, and a model file in which each neighbour adds a tenth of its signal.
fn write_truth(folder: &Path) {
    let faults = "\nmiswired = [{ element = 18, answers_for = 19 }, { element = 22, answers_for = 23 }]";
    let error = "origin_mm = [0.06, -0.04], rotation_deg = 0.2";
    assert!(SIMULATED_RIG.contains(faults) && SIMULATED_RIG.contains(error), "the rig file has changed");
    let rig = SIMULATED_RIG.replace(error, "origin_mm = [0.0, 0.0], rotation_deg = 0.0").replace(faults, "");
    fs::write(folder.join("rig.toml"), rig).unwrap();
    let model = fs::read_to_string(repository("config/models/digitacts.toml")).unwrap();
    let model = model.replace("noise_rms_counts = 2.0", "noise_rms_counts = 0.0");
    let shares = "{ neighbour_share = 0.1, diagonal_share = 0.0, row_neighbour_share = 0.0, row_share = 0.0, column_share = 0.0 }";
    let effect = format!("[[effect]]\nname = \"crosstalk\"\nparameters = {shares}\n");
    fs::write(folder.join("truth.toml"), format!("{model}\n{effect}")).unwrap();
}

#[test]
fn devices_hide_a_model_that_the_recording_shows_and_does_not_tell() {
    let folder = TempDir::new().unwrap();
    write_truth(folder.path());
    let record = |truth: &[&str]| {
        let args = ["element-centres", "--rig-file", "rig.toml", "--seed", "7", "--no-report"];
        let summary = run(folder.path(), &[&args, truth].concat());
        assert_eq!((&summary["simulated"], &summary["presses"]), (&true.into(), &48.into()));
        folder.path().join(summary["recording"].as_str().unwrap())
    };
    let (hidden, plain) = (record(&["--truth", "truth.toml"]), record(&[]));

    // The recorded counts are those of the model, up to the steps of converter and stage.
    let deepest = |recording: &Path| {
        let (_, readings) = rows::readings(&[recording]).unwrap();
        let press = readings
            .presses
            .iter()
            .find(|press| (press.place_mm[0] - 27.1).abs() + (press.place_mm[1] - 19.9).abs() < 0.01);
        press.unwrap().deepest().unwrap().counts.clone()
    };
    let press = [
        "--scene",
        "cylinder",
        "--x-mm",
        "7.1",
        "--y-mm",
        "4.9",
        "--depth-mm",
        "0.6",
        "--model",
        "truth.toml",
    ];
    let said = tactus(folder.path(), &[&["--json", "simulate"], &press[..]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    let image: Vec<f64> =
        serde_json::from_value::<Vec<Vec<f64>>>(said.json()["image"].clone()).unwrap().concat();
    let read = deepest(&hidden);
    for (element, (read, want)) in read.iter().zip(&image).enumerate() {
        assert!((read - want).abs() < 2.0, "element {element}: {read} {want}");
    }
    assert!(read[19] - 100.0 > 1.2 * 600.0, "without crosstalk 0.6 mm read 600 counts: {}", read[19]);
    let plain = deepest(&plain);
    assert!(
        plain.iter().zip(&image).any(|(plain, want)| (plain - want).abs() > 50.0),
        "the rig's own sensor"
    );

    // It contains the rig's description, but neither the rig file, whose sensor was not used, nor the model.
    let bytes = fs::read(&hidden).unwrap();
    let holds = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    let attachments: Vec<_> = tactus_record::read(&hidden)
        .unwrap()
        .filter_map(|entry| match entry.unwrap() {
            Entry::Attachment(file) => Some((file.name, String::from_utf8(file.data).unwrap())),
            Entry::Run(_) | Entry::Message { .. } => None,
        })
        .collect();
    assert!(attachments.iter().any(|(name, _)| name == "rig.json"));
    assert!(attachments.iter().all(|(name, text)| name != "rig.toml" && !text.contains("crosstalk")));
    assert!(!holds("crosstalk") && !holds("truth.toml"));
}

#[test]
fn a_truth_that_cannot_be_names_its_fault_and_nothing_runs() {
    let folder = TempDir::new().unwrap();
    write_truth(folder.path());
    let model = fs::read_to_string(folder.path().join("truth.toml")).unwrap();
    let early = "[[effect]]\nname = \"time-lag\"\nparameters = { lag_s = -0.2 }\n";
    for (text, fault) in [
        (model.replace("\"digitacts\"", "\"other\""), "\"other\" (6 x 8"),
        (model.replace("\"crosstalk\"", "\"cross-talk\""), "effect[0]: no effect \"cross-talk\""),
        (format!("{model}{early}"), "time-lag: lag_s = -0.2 cannot act"),
    ] {
        fs::write(folder.path().join("wrong.toml"), text).unwrap();
        let said = tactus(folder.path(), &["run", "corners", "--embedded", "--truth", "wrong.toml"]);
        assert_eq!(said.code, Some(2), "{said:?}");
        assert!(said.err.contains("wrong.toml: ") && said.err.contains(fault), "{said:?}");
    }
    assert!(!folder.path().join("runs").exists());
}

#[test]
fn plan_promises_what_run_then_does() {
    let folder = TempDir::new().unwrap();
    let plan = tactus(folder.path(), &["--json", "plan", "element-centres", "--embedded"]);
    assert_eq!(plan.code, Some(0), "{plan:?}");
    let plan = plan.json();
    assert_eq!((&plan["presses"], &plan["dwells"]), (&48.into(), &240.into()));
    assert!((plan["depth_max_mm"].as_f64().unwrap() - 0.6).abs() < 1e-9);
    assert!(plan["parameters"].as_array().unwrap().iter().any(|parameter| parameter["name"] == "depths_mm"));
}

#[test]
fn every_shipped_file_is_valid() {
    let folder = TempDir::new().unwrap();
    let files: Vec<_> = ["config", "config/rigs", "config/models", "experiments"]
        .iter()
        .flat_map(|folder| fs::read_dir(repository(folder)).unwrap())
        .map(|file| file.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| path.display().to_string())
        .collect();
    assert!(files.len() >= 6, "{files:?}");
    let mut args = vec!["validate"];
    args.extend(files.iter().map(String::as_str));
    let said = tactus(folder.path(), &args);
    assert_eq!(said.code, Some(0), "{said:?}");
}

#[test]
fn a_person_sees_how_far_a_dry_run_a_run_and_a_study_are() {
    let folder = TempDir::new().unwrap();
    let start = |args: &[&str]| Terminal::start("tactus", folder.path(), args, [120, 30]);
    let mut planned = start(&["plan", "grid-sweep", "--embedded"]);
    planned.wait_for(&["dry run ", " presses so far"]);
    // A script that nobody has run before: its steps say how long it takes.
    planned.wait_for(&["dry run ", " %", " left"]);
    drop(planned);
    let mut run = start(&["run", "element-centres", "--embedded"]);
    run.wait_for(&["dry run "]);
    run.wait_until(|screen| screen.contains("/48 presses") && screen.contains(" left"));
    drop(run);
    let mut study = start(&["study", "--embedded", "--points", "5", "--out", "study"]);
    study.wait_for(&["1 of 6, corners"]);
    study.wait_for(&["2 of 6, element-centres", "/48 presses"]);
}
