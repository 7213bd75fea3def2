use super::*;

use crate::commands::discover::model::tests::{before, found};

fn next(experiment: &'static str, part: &str, separates: [&str; 2], duration_s: f64) -> NextExperiment {
    NextExperiment {
        experiment,
        parameters: vec![("parts", part.to_owned())],
        duration_s,
        separates: separates.map(Into::into),
        expected_z: Some(9.0),
    }
}

fn undecided_between(next_experiments: Vec<NextExperiment>) -> Discovery {
    Discovery { next_experiments, ..found(&before()) }
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
    assert_eq!(parts(&choose(&found, 1000.0, &[])), ["rests", "wide"]);
}

#[test]
fn what_takes_too_long_gives_way_to_what_does_not() {
    let found = undecided_between(vec![
        next("diagnose", "hold", ["relaxation", "imprint"], 200.0),
        next("diagnose", "rests", ["relaxation", "imprint"], 100.0),
        next("diagnose", "wide", ["heavy-tail", "crosstalk"], 60.0),
    ]);
    assert_eq!(parts(&choose(&found, 150.0, &[])), ["rests"]);
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
    assert!(choose(&found, 1000.0, &[done]).is_empty());
}

#[test]
fn what_is_unexplained_is_diagnosed_within_the_time_there_is() {
    let unexplained = Discovery { verdict: Verdict::Unexplained, ..undecided_between(Vec::new()) };
    let chosen = choose(&unexplained, 0.5 * DIAGNOSE_S, &[]);
    assert_eq!(chosen, [ChosenExperiment::diagnose(0.5)]);
    assert!(choose(&unexplained, 30.0, &[]).is_empty(), "too short to tell anything");
    assert!(choose(&undecided_between(Vec::new()), 1e4, &[]).is_empty(), "nothing is left to tell");
}
