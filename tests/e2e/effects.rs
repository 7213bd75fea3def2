//! The lab's own library: `tactus effects` lists, shows, renames and retires drafts.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use tactus_e2e::tactus;
use tempfile::TempDir;

const GROUNDED: &str = r#"
schema = "tactus.draft/1"
status = "drafted"

[effect]
name = "draft-1"
sentence = "While the tool touches, counts are added, a number that is constant: 3.00 counts"
stage = "readout"
carrier = "counts"
combine = "add"
when = "in contact"
law = "linear"
numbers = { offset = 3.0, slope = 0.0 }

[[effect.covariate]]
name = "depth"
unit = "mm"
range = [0.0, 0.6]
"#;

#[test]
fn the_labs_drafts_are_listed_shown_renamed_and_retired() {
    let folder = TempDir::new().unwrap();
    let drafts = folder.path().join("drafts");
    fs::create_dir(&drafts).unwrap();
    fs::write(drafts.join("draft-1.toml"), GROUNDED).unwrap();
    let effects =
        |args: &[&str]| tactus(folder.path(), &[&["effects", "--library", "drafts"], args].concat());

    let listed = effects(&["--json"]).json();
    let names: Vec<&str> =
        listed["effects"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!((names.len(), names.last()), (27, Some(&"draft-1")), "{names:?}");
    let said = effects(&[]);
    assert!(said.out.contains("draft-1") && said.out.contains("hardening"), "{said:?}");
    let said = effects(&["show", "draft-1"]);
    for part in ["While the tool touches", "linear: offset 3.0000", "depth, 0.000 to 0.600 mm", "drafted"] {
        assert!(said.out.contains(part), "{part}: {said:?}");
    }
    assert!(effects(&["show", "softening"]).out.contains("shown by"));

    let said = effects(&["show", "draft-1", "--figure", "curve.svg"]);
    assert!(said.code == Some(2) && said.err.contains("no curve to draw"), "a constant has none: {said:?}");
    let slope = GROUNDED.replace("slope = 0.0", "slope = 2.0").replace("draft-1", "sloping");
    fs::write(drafts.join("sloping.toml"), slope).unwrap();
    assert_eq!(effects(&["show", "sloping", "--figure", "curve.svg"]).code, Some(0));
    let drawn = fs::read_to_string(folder.path().join("curve.svg")).unwrap();
    assert!(drawn.contains("depth / mm") && drawn.contains("counts"), "{drawn}");
    fs::remove_file(drafts.join("sloping.toml")).unwrap();

    for (to, want) in [("hardening", "of the library"), ("Draft 2", "small letters")] {
        let said = effects(&["rename", "draft-1", to]);
        assert_eq!(said.code, Some(2), "{said:?}");
        assert!(said.err.contains(want), "{said:?}");
    }
    assert_eq!(effects(&["rename", "draft-1", "grounding"]).code, Some(0));
    assert!(!drafts.join("draft-1.toml").exists());
    let said = tactus(folder.path(), &["validate", "drafts/grounding.toml"]);
    assert!(said.out.contains(r#"draft "grounding", drafted"#), "{said:?}");
    assert_eq!(effects(&["retire", "grounding"]).code, Some(0));
    assert_eq!(effects(&["show", "grounding", "--json"]).json()["status"], "retired");

    let said = effects(&["retire", "draft-1"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains(r#"no draft "draft-1"; there is: grounding"#), "{said:?}");
    fs::write(drafts.join("twice.toml"), GROUNDED.replace("draft-1", "grounding")).unwrap();
    let said = effects(&[]);
    assert!(said.err.contains("drafts/twice.toml: ") && said.err.contains("too"), "{said:?}");
}

#[test]
fn a_draft_is_put_into_the_labs_library_which_has_a_folder_of_its_own() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("draft-1.toml"), GROUNDED).unwrap();
    let effects = |args: &[&str]| tactus(folder.path(), &[&["effects"], args].concat());
    let count = || effects(&["--json"]).json()["effects"].as_array().unwrap().len();
    assert_eq!(count(), 26, "the lab has none yet");

    let said = effects(&["add", "draft-1.toml"]);
    assert!(said.code == Some(0) && said.out.contains("every discovery tries draft-1"), "{said:?}");
    assert!(folder.path().join("state/tactus/effects/draft-1.toml").exists());
    assert_eq!(count(), 27);

    let said = effects(&["add", "draft-1.toml"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("rename that one") && said.err.contains("draft-1.toml"), "{said:?}");
    assert_eq!(effects(&["rename", "draft-1", "grounding"]).code, Some(0));
    assert_eq!(effects(&["add", "draft-1.toml"]).code, Some(0));
    assert_eq!(count(), 28);

    fs::write(folder.path().join("foreign.toml"), "schema = \"tactus.rig/1\"\n").unwrap();
    let said = effects(&["add", "foreign.toml"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("foreign.toml: "), "{said:?}");
    assert_eq!(count(), 28, "nothing is added");
}
