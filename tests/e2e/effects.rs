//! The lab's own library: `tactus effects` lists, shows, renames and retires drafts.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;

use serde_json::json;
use tactus_e2e::{repository, tactus};
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
    let said = effects(&["show", "sloping", "--figure", "curve.svg"]);
    assert!(said.code == Some(0) && said.out.contains("curve.svg"), "{said:?}");
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
    assert_eq!(said.code, Some(3), "{said:?}");
    assert!(said.out.contains("refused: drafts/grounding.toml has a draft \"grounding\", too"), "{said:?}");
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
    assert!(said.err.contains("effects rename draft-1 NEW") && said.err.contains("draft-1.toml"), "{said:?}");
    assert_eq!(effects(&["rename", "draft-1", "grounding"]).code, Some(0));
    assert_eq!(effects(&["add", "draft-1.toml"]).code, Some(0));
    assert_eq!(count(), 28);

    fs::write(folder.path().join("foreign.toml"), "schema = \"tactus.rig/1\"\n").unwrap();
    let said = effects(&["add", "foreign.toml"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("foreign.toml: "), "{said:?}");
    assert_eq!(count(), 28, "nothing is added");
}

/// A draft of which a new measurement has told.
fn measured(status: &str) -> String {
    let strength = if status == "confirmed" { 1.01 } else { 0.02 };
    let covariance = "covariance = [[0.01, 0.0], [0.0, 0.02]]";
    let stated = GROUNDED.replace("status = \"drafted\"", &format!("status = \"{status}\"\n{covariance}"));
    format!(
        "{stated}\n[[nearest]]\nclass = \"saturation\"\nln_odds_behind = 31.4\n\n[evidence]\nseed = 1\np_value = 0.0005\nln_odds = 103.25\n\
         folds = 5\nclosed_share = 0.93\n\n[evidence.data]\nrun-1 = \"00ff\"\n\n[confirmation]\nstrength = {strength}\nclosed_share = 0.95\n\n\
         [confirmation.data]\nrun-2 = \"11ee\"\n"
    )
}

#[test]
fn all_that_effects_says_is_one_object_for_programs() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("draft-1.toml"), measured("confirmed")).unwrap();
    let effects = |args: &[&str]| {
        let said = tactus(folder.path(), &[&["--json", "effects", "--library", "own"], args].concat());
        assert_eq!(said.code, Some(0), "{said:?}");
        said.json()
    };
    let added = effects(&["add", "draft-1.toml"]);
    assert_eq!(added, json!({ "name": "draft-1", "status": "confirmed", "file": "own/draft-1.toml" }));
    let version_before = effects(&["show", "draft-1"])["version"].as_str().unwrap().to_owned();
    let renamed = effects(&["rename", "draft-1", "grounding"]);
    assert_eq!(renamed, json!({ "name": "grounding", "status": "confirmed", "file": "own/grounding.toml" }));
    let retired = effects(&["retire", "grounding"]);
    assert_eq!(retired, json!({ "name": "grounding", "status": "retired", "file": "own/grounding.toml" }));
    let version = |shown: &serde_json::Value| shown["version"].as_str().unwrap().to_owned();
    let while_retired = version(&effects(&["show", "grounding"]));
    assert_eq!(while_retired, version_before, "neither a name nor a status is another version");
    assert_eq!(while_retired.len(), 64);
    assert_eq!(effects(&["use", "grounding"]), renamed, "it is what it was before");
    let shown = effects(&["show", "grounding"]);
    assert_eq!(shown["file"], "own/grounding.toml");
    assert_eq!(shown["numbers"], json!({ "offset": 3.0, "slope": 0.0 }));
    assert_eq!(shown["covariates"], json!([{ "name": "depth", "unit": "mm", "range": [0.0, 0.6] }]));
    assert_eq!(shown["covariance"], json!([[0.01, 0.0], [0.0, 0.02]]));
    assert_eq!((&shown["unit"], &shown["confirmation"]["strength"]), (&json!("counts"), &json!(1.01)));
    assert!(shown["weights"].is_null() && shown["values"].is_null(), "{shown}");
    let listed = effects(&["list"]);
    assert_eq!((&listed["folder"], &listed["refused"]), (&json!("own"), &json!([])));
    assert_eq!(listed["effects"].as_array().unwrap().last(), Some(&shown));
}

#[test]
fn what_is_said_of_a_draft_is_true_of_its_status() {
    let folder = TempDir::new().unwrap();
    let effects = |args: &[&str]| tactus(folder.path(), &[&["effects", "--library", "own"], args].concat());
    fs::write(folder.path().join("refuted.toml"), measured("refuted")).unwrap();
    let said = effects(&["add", "refuted.toml"]);
    assert!(
        said.code == Some(0) && said.out.contains("kept, but refuted: no discovery tries it"),
        "{said:?}"
    );
    assert!(!said.out.contains("every discovery") && !said.out.contains("tries it on"), "{said:?}");
    let said = effects(&["show", "draft-1"]);
    assert!(!said.out.contains("discover RUNS") && said.out.contains("effects confirm draft-1"), "{said:?}");
    assert_eq!(effects(&["retire", "draft-1"]).code, Some(0));
    let said = effects(&["add", "refuted.toml"]);
    assert!(said.code == Some(2) && !said.err.contains("retire"), "retiring does not help: {said:?}");
    let said = effects(&["confirm", "draft-1", "nowhere.mcap"]);
    assert!(said.code == Some(2) && said.err.contains("effects use draft-1"), "{said:?}");
    let said = effects(&["use", "draft-1"]);
    assert!(said.out.contains("kept, but refuted"), "{said:?}");

    let said = effects(&["show", "nothere"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(
        said.err.contains("hysteresis") && said.err.contains("of the lab's own there is: draft-1"),
        "{said:?}"
    );
    assert!(effects(&["list"]).out.contains("the lab's own: 1 in own"));
}

#[test]
fn one_damaged_file_leaves_the_others_in_use_and_is_named() {
    let folder = TempDir::new().unwrap();
    let drafts = folder.path().join("own");
    fs::create_dir(&drafts).unwrap();
    fs::write(drafts.join("good.toml"), GROUNDED).unwrap();
    fs::write(drafts.join("bad.toml"), GROUNDED.replace("\"mm\"", "\"s\"")).unwrap();
    let run = |args: &[&str]| tactus(folder.path(), args);
    let said = run(&["effects", "--library", "own"]);
    assert_eq!(said.code, Some(3), "{said:?}");
    assert!(
        said.out.contains("refused: line 17: effect.covariate[0].unit") && said.out.contains("draft-1"),
        "{said:?}"
    );
    let listed = run(&["--json", "effects", "--library", "own"]).json();
    assert_eq!(listed["refused"][0]["file"], "own/bad.toml");
    assert_eq!(run(&["effects", "--library", "own", "show", "draft-1"]).code, Some(0));
    let said = run(&["discover", "nowhere.mcap", "--library", "own"]);
    assert_eq!(said.code, Some(2), "{said:?}");
    for part in ["own/bad.toml: line 17", "correct it or move it out of own"] {
        assert!(said.err.contains(part), "{part}: {said:?}");
    }
}

#[test]
fn a_damaged_draft_is_refused_with_its_place_and_a_wrong_command_line() {
    let folder = TempDir::new().unwrap();
    let text = measured("confirmed");
    let add = |bytes: &[u8]| {
        fs::write(folder.path().join("damaged.toml"), bytes).unwrap();
        tactus(folder.path(), &["effects", "--library", "own", "add", "damaged.toml"])
    };
    let within = |part: &str| text.find(part).unwrap();
    let cut = |part: &str| text.as_bytes()[..within(part)].to_vec();
    let mut binary = text.clone().into_bytes();
    binary[within("While")] = 0xff;
    for (damaged, want) in [
        (cut("[evidence]"), "evidence: is missing"),
        (cut("[confirmation]"), "confirmation: is missing"),
        (cut("run-2"), "line 39: confirmation.data"),
        (text.replace("[0.0, 0.02]", "[3]").into_bytes(), "line 4: covariance[1]"),
        (text.replace("[0.0, 0.6]", "[0.6, 0.0]").into_bytes(), "line 19: effect.covariate[0].range"),
        (text.replace("offset = 3.0", "offset = nan").into_bytes(), "line 14: effect.numbers.offset"),
        (binary, "line 8: no text (UTF-8)"),
    ] {
        let said = add(&damaged);
        assert_eq!(said.code, Some(2), "{want}: {said:?}");
        assert!(said.err.contains(&format!("damaged.toml: {want}")), "{want}: {said:?}");
    }
    assert!(!folder.path().join("own").exists(), "nothing is added");
    assert_eq!(add(text.as_bytes()).code, Some(0), "a folder that is not there is an empty library");
}

#[test]
fn a_draft_is_no_model_and_says_where_its_model_is() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("draft-1.toml"), GROUNDED).unwrap();
    for args in [
        &["simulate", "--model", "draft-1.toml"][..],
        &["discover", "nowhere.mcap", "--model", "draft-1.toml"],
    ] {
        let said = tactus(folder.path(), args);
        assert_eq!(said.code, Some(2), "{said:?}");
        assert!(said.err.contains("discovery wrote model.toml beside it"), "{said:?}");
    }
}

/// The model of the shipped sensor with a draft that acts by the sum of signals, up to one of 2 mm.
fn model_with_a_draft() -> String {
    let sagging = GROUNDED.replace("\"readout\"", "\"element\"").replace("\"counts\"", "\"own signal\"");
    let sagging = sagging.replace("\"add\"", "\"multiply\"").replace("offset = 3.0", "offset = -0.1");
    let sagging = sagging.replace("\"depth\"", "\"sum of signals\"").replace("[0.0, 0.6]", "[0.0, 2.0]");
    let draft = sagging[sagging.find("name = \"draft-1\"").unwrap()..]
        .replace("[[effect.covariate]]", "[[effect.draft.covariate]]");
    let model = fs::read_to_string(repository("config/models/digitacts.toml")).unwrap();
    format!(
        "{model}\n[[effect]]\nname = \"draft-1\"\nparameters = {{ strength = 1.0 }}\n[effect.draft]\n{draft}"
    )
}

#[test]
fn a_simulation_names_its_effects_and_where_it_leaves_a_drafts_range() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("model.toml"), model_with_a_draft()).unwrap();
    let simulate = ["simulate", "--model", "model.toml", "--scene"];
    let said = tactus(folder.path(), &[&simulate[..], &["h", "--depth-mm", "0.3"]].concat());
    assert!(said.out.contains("effects   draft-1"), "{said:?}");
    assert!(
        said.out.contains("draft-1 was drafted up to a sum of signals of 2.000 mm; here it is"),
        "{said:?}"
    );
    let said =
        tactus(folder.path(), &[&["--json"][..], &simulate, &["cylinder", "--depth-mm", "0.1"]].concat());
    let found = said.json();
    assert_eq!((&found["effects"], &found["notes"]), (&json!(["draft-1"]), &json!([])), "{said:?}");

    fs::write(folder.path().join("path.csv"), "t_s,x_mm,y_mm,z_mm\n0,8,6,1\n1,8,6,-0.3\n").unwrap();
    let path = ["h", "--trajectory", "path.csv", "--out", "frames.csv"];
    let said = tactus(folder.path(), &[&simulate[..], &path].concat());
    assert!(said.err.contains("where the tip is deepest: draft-1 was drafted up to"), "{said:?}");
}
