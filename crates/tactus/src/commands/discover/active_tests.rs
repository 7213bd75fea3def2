use tactus_discover::{OpenQuestion, Plan};

use super::*;

use crate::commands::discover::model::tests::{before, found};

fn next(experiment: &'static str, part: &str, separates: [&str; 2], duration_s: f64) -> NextExperiment {
    NextExperiment {
        experiment: experiment.to_owned(),
        parameters: vec![("parts", part.to_owned())],
        seed: 11,
        duration_s,
        separates: separates.map(Into::into),
        expected_z: Some(9.0),
    }
}

/// A `diagnose` has parts of a least length, and others take no part.
fn planned_s(one: &ChosenExperiment) -> Result<f64, String> {
    let scale = one.parameters.iter().find(|(name, _)| *name == "scale");
    let scale = scale.map_or(Ok(1.0), |(_, scale)| scale.parse::<f64>());
    scale.map(|scale| scale * 770.0 + 170.0).map_err(|error| error.to_string())
}

fn undecided_between(next_experiments: Vec<NextExperiment>) -> Discovery {
    Discovery { plan: Plan { next: next_experiments, ..Plan::default() }, ..found(&before()) }
}

fn parts(chosen: &[ChosenExperiment]) -> Vec<&str> {
    chosen.iter().map(|one| one.parameters[0].1.as_str()).collect()
}

#[test]
fn one_experiment_is_chosen_for_each_question_and_each_once() {
    let found = undecided_between(vec![
        next("diagnose", "rests", ["relaxation", "imprint"], 100.0),
        next("diagnose", "hold", ["relaxation", "imprint"], 200.0),
        next("diagnose", "rests", ["relaxation", "baseline-drift"], 100.0),
        next("diagnose", "wide", ["heavy-tail", "crosstalk"], 300.0),
        next("diagnose", "drift", ["baseline-drift", "nothing"], 10.0),
    ]);
    let chosen = choose(&found, &[], 1000.0, &[], &planned_s).unwrap();
    assert_eq!(parts(&chosen), ["rests", "wide"]);
    assert!(chosen.iter().all(|one| one.seed == Some(11)), "as rehearsed");
}

#[test]
fn what_takes_too_long_gives_way_to_what_does_not() {
    let found = undecided_between(vec![
        next("diagnose", "hold", ["relaxation", "imprint"], 200.0),
        next("diagnose", "rests", ["relaxation", "imprint"], 100.0),
        next("diagnose", "wide", ["heavy-tail", "crosstalk"], 60.0),
    ]);
    assert_eq!(parts(&choose(&found, &[], 150.0, &[], &planned_s).unwrap()), ["rests"]);
}

#[test]
fn an_experiment_that_was_made_is_not_made_again() {
    let found = undecided_between(vec![next("diagnose", "rests", ["relaxation", "imprint"], 100.0)]);
    let done = ActiveRun {
        experiment: "diagnose".into(),
        parameters: vec![("parts", "rests".into())],
        recording: "r".into(),
        duration_s: 99.0,
        separates: ["relaxation".into(), "imprint".into()],
        expected_z: None,
        before: Vec::new(),
        after: Vec::new(),
    };
    let why = choose(&found, &[], 1000.0, &[done], &planned_s).unwrap_err();
    assert_eq!(why, "`tactus run diagnose -p parts=rests` was run already");
}

#[test]
fn what_is_unexplained_is_diagnosed_within_the_time_there_is() {
    let unexplained = Discovery { verdict: Verdict::Unexplained, ..undecided_between(Vec::new()) };
    for (budget_s, command, takes_s) in [
        (940.0, "tactus run diagnose", 940.0),
        (939.0, "tactus run diagnose -p scale=0.99", 932.3),
        (550.0, "tactus run diagnose -p scale=0.49", 547.3),
        (247.0, "tactus run diagnose -p scale=0.1", 247.0),
    ] {
        let chosen = choose(&unexplained, &[], budget_s, &[], &planned_s).unwrap();
        let [one] = &chosen[..] else { panic!("{chosen:?}") };
        assert_eq!(one.command(), command);
        assert!((one.duration_s - takes_s).abs() < 1e-9 && one.duration_s <= budget_s, "{one:?}");
    }
    let why = choose(&unexplained, &[], 246.0, &[], &planned_s).unwrap_err();
    let too_long =
        "`tactus run diagnose -p scale=0.1` takes 4 min 07 s, and 4 min 06 s of the budget are left";
    assert!(why.ends_with(too_long), "{why}");
    let unknown = |_: &ChosenExperiment| Err("`tactus run diagnose` cannot be planned: no sample".to_owned());
    let why = choose(&unexplained, &[], 940.0, &[], &unknown).unwrap_err();
    assert!(why.ends_with("cannot be planned: no sample"), "{why}");
}

#[test]
fn why_nothing_is_run_is_told() {
    let decided = Discovery { verdict: Verdict::Explained, ..undecided_between(Vec::new()) };
    assert_eq!(choose(&decided, &[], 1e4, &[], &planned_s).unwrap_err(), "no two explanations are undecided");
    let shows = next("diagnose", "drift", ["baseline-drift", "nothing"], 10.0);
    let decided = Discovery { plan: Plan { next: vec![shows], ..Plan::default() }, ..decided };
    assert_eq!(choose(&decided, &[], 1e4, &[], &planned_s).unwrap_err(), "no two explanations are undecided");
    let long = next("diagnose", "wide", ["heavy-tail", "crosstalk"], 300.0);
    let question = OpenQuestion { separates: ["imprint".into(), "relaxation".into()], best: None };
    let plan = Plan { next: vec![long], open: vec![question], left_out: Vec::new() };
    let undecided = Discovery { plan, ..decided };
    assert_eq!(
        choose(&undecided, &[], 60.0, &[], &planned_s).unwrap_err(),
        "no experiment would distinguish imprint from relaxation: none of those that would could be rehearsed; `tactus run diagnose \
         -p parts=wide` takes 5 min 00 s, and 1 min 00 s of the budget are left"
    );
}

/// A run of `diagnose` that was made, with one parameter.
fn done(parameter: (&'static str, &str), separates: [&str; 2]) -> ActiveRun {
    ActiveRun {
        experiment: "diagnose".into(),
        parameters: vec![(parameter.0, parameter.1.into())],
        recording: "r".into(),
        duration_s: 99.0,
        separates: separates.map(Into::into),
        expected_z: None,
        before: Vec::new(),
        after: Vec::new(),
    }
}

#[test]
fn a_new_draft_is_measured_by_an_experiment_that_has_refuted_another_one() {
    let found = undecided_between(vec![next("diagnose", "depths", ["draft-2", "noise"], 30.0)]);
    let first = done(("parts", "depths"), ["draft-1", "noise"]);
    let chosen = choose(&found, &[], 1000.0, std::slice::from_ref(&first), &planned_s).unwrap();
    assert_eq!((parts(&chosen), chosen[0].seed), (vec!["depths"], Some(12)), "with another seed");
    let second = done(("parts", "depths"), ["draft-2", "noise"]);
    let why = choose(&found, &[], 1000.0, &[first, second], &planned_s).unwrap_err();
    assert!(why.starts_with("`tactus run diagnose -p parts=depths` was run already"), "{why}");
}

#[test]
fn a_part_of_a_diagnosis_is_not_all_of_it() {
    let unexplained = Discovery { verdict: Verdict::Unexplained, ..undecided_between(Vec::new()) };
    let part = done(("parts", "depths"), ["draft-1", "noise"]);
    let chosen = choose(&unexplained, &[], 2e3, &[part], &planned_s).unwrap();
    assert_eq!(chosen, [ChosenExperiment { duration_s: 940.0, ..ChosenExperiment::diagnose(100) }]);
    let half = done(("scale", "0.5"), [MISSING, NOISE]);
    let why = choose(&unexplained, &[], 555.0, &[half], &planned_s).unwrap_err();
    assert!(why.ends_with("`tactus run diagnose -p scale=0.5` was run already"), "{why}");
}

#[test]
fn an_unconfirmed_draft_of_the_library_is_measured_anew() {
    let text = "schema = 'tactus.draft/1'\nstatus = 'drafted'\n[effect]\nname = 'draft-1'\nsentence = 'It rises.'\nstage = 'readout'\n\
                carrier = 'counts'\ncombine = 'add'\nwhen = 'in contact'\nlaw = 'linear'\nnumbers = { offset = 3.0, slope = 0.0 }\n\
                [[effect.covariate]]\nname = 'depth'\nunit = 'mm'\nrange = [0.0, 0.6]\n";
    let held = Held { path: "draft-1.toml".into(), draft: DraftFile::from_toml(text).unwrap() };
    let explained = Discovery { verdict: Verdict::Explained, ..undecided_between(Vec::new()) };
    let chosen = choose(&explained, &[&held], 1e4, &[], &planned_s).unwrap();
    assert_eq!(chosen[0].separates, ["draft-1", "noise"]);
    assert_eq!(chosen[0].command(), "tactus run diagnose -p scale=0.3");
    assert_ne!(chosen[0].seed, Some(explained.seed));
    let why = choose(&explained, &[&held], 30.0, &[], &planned_s).unwrap_err();
    assert!(why.ends_with("takes 4 min 07 s, and 30.0 s of the budget are left"), "{why}");
}
