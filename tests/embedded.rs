//! The README's first command, and what it promises.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use serde_json::Value;
use tactus_e2e::{repository, tactus};
use tactus_record::{Entry, Message};
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
    let said = tactus(folder, &[&["--endpoint", "tcp/127.0.0.1:1", "--json", "run"], args].concat());
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
fn without_a_service_the_first_line_says_that_it_is_simulated() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("two.star"), TWO_PRESSES).unwrap();
    let said = tactus(folder.path(), &["--endpoint", "tcp/127.0.0.1:1", "run", "two.star", "--no-report"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let first = said.out.lines().next().unwrap();
    assert!(
        first.contains("SIMULATED") && first.contains("embedded") && first.contains("no service"),
        "{first}"
    );
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

/// Every message without what must differ: the run's name and the wall clock.
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

#[test]
fn plan_promises_what_run_then_does() {
    let folder = TempDir::new().unwrap();
    let plan = tactus(folder.path(), &["--json", "plan", "element-centres"]);
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
