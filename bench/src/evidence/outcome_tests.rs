use serde_json::json;
use tactus_sets::{Content, Recipe};

use super::*;

fn named(names: &[(&str, &[&str])]) -> Vec<Named> {
    let named = |(effect, others): &(&str, &[&str])| Named {
        effect: (*effect).into(),
        equivalent: others.iter().map(|other| (*other).into()).collect(),
    };
    names.iter().map(named).collect()
}

/// A set with hidden effects, and a report with names.
pub(crate) fn set(truths: &[Option<&str>], names: &[(&str, &[&str])], verdict: &str) -> Outcome {
    let truth = |effect: Option<&str>| Truth {
        physics: "made-up".into(),
        effect: effect.map(Into::into),
        is_library_point: false,
        z: 40.0,
        z_name: Some(20.0),
        own_shrink: None,
    };
    Outcome {
        id: "names/made-up".into(),
        campaign: Campaign::Names,
        truths: truths.iter().copied().map(truth).collect(),
        noise: [1.0, 0.0],
        named: named(names),
        taken: Vec::new(),
        verdict: verdict.into(),
        shrink: Some(0.9),
        deeper_shrink: None,
        shrink_error: 0.01,
        alone_shrink: None,
        draft: None,
        seconds: 1.0,
        peak_mib: 100.0,
    }
}

#[test]
fn an_exact_name_is_the_effect_and_nothing_else() {
    let exact = set(&[Some("backlash")], &[("backlash", &["hysteresis"])], "explained");
    assert!(exact.is_exact() && exact.holds_all() && exact.wrong_names().is_empty());
    let more = set(&[Some("backlash")], &[("backlash", &[]), ("imprint", &[])], "explained");
    assert!(more.names_all() && !more.is_exact());
    assert_eq!(more.wrong_names(), ["imprint"]);
}

#[test]
fn a_twin_with_the_truth_in_its_set_is_neither_exact_nor_wrong() {
    let twin = set(&[Some("backlash")], &[("hysteresis", &["backlash"])], "explained");
    assert!(!twin.is_exact() && twin.holds_all() && twin.wrong_names().is_empty());
}

#[test]
fn one_name_does_not_stand_for_two_effects() {
    let truths = [Some("backlash"), Some("hysteresis")];
    let one = set(&truths, &[("hysteresis", &["backlash"])], "explained");
    assert!(!one.holds_all());
    let both = set(&truths, &[("hysteresis", &["backlash"]), ("imprint", &["hysteresis"])], "explained");
    assert!(both.holds_all() && !both.names_all());
}

#[test]
fn outside_the_library_no_name_is_right() {
    let outside = set(&[None], &[("backlash", &[])], "partly-explained");
    assert!(!outside.is_exact() && !outside.holds_all());
    assert_eq!(outside.wrong_names(), ["backlash"]);
}

#[test]
fn unexplained_is_detected_and_a_failure_is_not() {
    assert!(set(&[None], &[], "unexplained").is_detected());
    assert!(!set(&[None], &[], "nothing-missing").is_detected());
    for verdict in ["failed", "cannot-judge"] {
        let unjudged = set(&[None], &[], verdict);
        assert!(unjudged.has_failed() && !unjudged.is_detected());
    }
}

#[test]
fn labels_and_reports_are_read_from_files() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let places = Places { work: folder.path().join("work"), labels: folder.path().join("labels") };
    let physics = vec!["relaxation-prony".into()];
    let recipe =
        Recipe { frames: Some(300), content: Content { physics, ..Content::default() }, ..Recipe::new(3) };
    let id = "names/relaxation-prony-s1-0".to_owned();
    let set = Planned { id: id.clone(), campaign: Campaign::Names, recipe };
    assert_eq!(read(std::slice::from_ref(&set), &places)?, [], "the set was not run");

    let label = set.recipe.make()?.label;
    let ran = Ran {
        program: String::new(),
        seconds: 9.0,
        processor_s: 2.5,
        peak_mib: 80.0,
        exit: Some(0),
        said: String::new(),
    };
    let report = json!({
        "split": { "frames": 3000, "train_presses": 20, "heldout_presses": 10 },
        "base": { "heldout_chi2": 1.5 },
        "rounds": [{ "candidates": [{ "effect": "relaxation", "shrink": 0.75 }], "taken": "time-lag" }],
        "steps": [{ "effect": "relaxation", "equivalent": ["time-lag"] }],
        "final": { "shrink": 0.9 },
        "verdict": "explained",
    });
    let files = [
        (places.label(&id), serde_json::to_string(&label)?),
        (places.ran(&id), serde_json::to_string(&ran)?),
        (places.report(&id), report.to_string()),
    ];
    for (path, text) in files {
        fs::create_dir_all(path.parent().context("a folder")?)?;
        fs::write(path, text)?;
    }
    let [outcome] = &read(&[set], &places)?[..] else { panic!("one set") };
    assert!(outcome.is_exact());
    assert_eq!((outcome.shrink, outcome.alone_shrink, outcome.seconds), (Some(0.9), Some(0.75), 2.5));
    assert_eq!(outcome.taken, ["time-lag"]);
    assert!((outcome.z() - label.z_beyond_spread).abs() < 1e-12);
    // 48,000 readings held out, a gap of half the noise's power.
    let phi = label.noise.phi;
    let error = (2.0 * (1.0 + phi * phi) / (48_000.0 * (1.0 - phi * phi))).sqrt() / 0.5;
    assert!((outcome.shrink_error - error).abs() < 1e-12);
    let report = report.to_string().replace("\"shrink\":0.9", "\"shrink\":0.9,\"shrink_se\":0.03");
    fs::write(places.report(&id), report)?;
    let set = Planned { id: id.clone(), campaign: Campaign::Names, recipe: Recipe::new(3) };
    assert!((read(&[set], &places)?[0].shrink_error - 0.03).abs() < 1e-12);

    fs::remove_file(places.report(&id))?;
    let set = Planned { id, campaign: Campaign::Names, recipe: Recipe::new(3) };
    assert!(read(&[set], &places)?[0].has_failed());
    Ok(())
}

#[test]
fn a_shrink_is_over_that_of_the_own_fit_without_noise() {
    let mut right = set(&[Some("backlash")], &[("backlash", &[])], "explained");
    right.alone_shrink = Some(0.5);
    assert!(right.shrink_to_fit_in_report().is_some_and(|shrink| (shrink - 1.8).abs() < 1e-12));
    assert_eq!(right.shrink_to_own_fit(), None);
    right.truths[0].own_shrink = Some(0.9);
    assert!(right.shrink_to_own_fit().is_some_and(|shrink| (shrink - 1.0).abs() < 1e-12));
    assert_eq!(Outcome { verdict: "failed".into(), ..right.clone() }.shrink_to_own_fit(), Some(0.0));
    assert_eq!(Outcome { shrink_error: 0.2, ..right }.shrink_to_own_fit(), None);
}

#[test]
fn the_least_separate_effect_counts_and_one_without_a_figure_leaves_none() {
    let mut two = set(&[Some("backlash"), Some("imprint")], &[], "nothing-missing");
    two.truths[1].z_name = Some(3.0);
    assert_eq!(two.z_name(), Some(3.0));
    two.truths[0].z_name = None;
    assert_eq!(two.z_name(), None);
}
