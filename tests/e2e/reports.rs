//! What a run's report draws, and what it leaves unsaid.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use tactus_e2e::tactus;
use tempfile::TempDir;

/// Nine elements in a corner, at two depths.
const NINE: &str = "def run(rig):\n    tare()\n    for element in rig.elements:\n        if element.row < 3 and element.col < 3:\n            press(element.x_mm, element.y_mm, depths_mm = [0.2, 0.4])\n";

/// The report of a run on the embedded rig.
fn report(folder: &Path, args: &[&str]) -> String {
    let said = tactus(folder, &[&["--json", "run"], args, &["--embedded", "--seed", "3"]].concat());
    assert_eq!(said.code, Some(0), "{said:?}");
    fs::read_to_string(folder.join(said.json()["report"].as_str().unwrap())).unwrap()
}

#[test]
fn a_report_draws_what_the_run_was_for() {
    let folder = TempDir::new().unwrap();
    let diagnose = report(folder.path(), &["diagnose", "-p", "scale=0.1"]);
    for heading in ["creep", "hysteresis", "rate dependence", "backlash and friction", "Drift at rest"] {
        assert!(diagnose.contains(heading), "{heading}");
    }
    assert!(diagnose.contains("<nav class=\"contents\">") && !diagnose.contains("Maps of places"));
    let sweep = report(folder.path(), &["grid-sweep", "-p", "points=3", "-p", "coverings_mm=[1.016]"]);
    assert_eq!(
        sweep.matches("<figcaption><b>element 19 (2, 3)</b>, depth").count(),
        3,
        "a map for each depth"
    );
    assert!(!sweep.contains("hysteresis") && !sweep.contains("creep"));
}

#[test]
fn elements_that_were_not_pressed_are_not_vouched_for() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("nine.star"), NINE).unwrap();
    let nine = report(folder.path(), &["nine.star"]);
    assert!(
        nine.contains(
            "39 were not pressed at their centre at several depths: of these this run says nothing"
        )
    );
    assert!(!nine.contains("Every"), "no assurance about the others");
    // The response's map and the images name the elements.
    assert!(nine.contains("The elements with their numbers") && nine.contains(">10: 0.200</text>"));
}
