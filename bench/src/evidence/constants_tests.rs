use super::super::contests::Class;
use super::*;

fn class(effect: &str, ln_odds: f64) -> Class {
    Class { effect: effect.into(), ln_odds }
}

fn reported(effect: &str, ln_odds: f64, classes: Vec<Class>, kept: bool) -> Reported {
    Reported { effect: effect.into(), ln_odds, rivals: Vec::new(), classes, left_ln_odds: 0.0, kept }
}

fn told(contests: Vec<Reported>) -> Told {
    let names = contests.iter().filter(|one| one.kept);
    let named = |one: &Reported| Named { effect: one.effect.clone(), equivalent: Vec::new() };
    Told {
        steps: names.map(named).collect(),
        contests,
        last: Last { shrink: Some(0.9), shrink_se: Some(0.01) },
        verdict: "explained".into(),
        unexplained: Unexplained { depends_on: Vec::new() },
        given_up: Vec::new(),
    }
}

fn near(found: [f64; 2], wanted: [f64; 2]) -> bool {
    found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-12)
}

#[test]
fn a_hidden_class_that_is_behind_is_held_once_forms_may_mislead_by_as_much() {
    let mut observed = Observed::default();
    let behind = vec![class("low-pass", 990.0), class("relaxation", 500.0)];
    observed.add(&["low-pass"], &told(vec![reported("time-lag", 1000.0, behind, true)]));
    // e^-10 beside 1, then e^(-10/11) / sqrt(11) = 0.12 beside 1.
    assert!(near(observed.sets_at(0.0), [0.0, 1.0]));
    assert!(near(observed.sets_at(0.01), [1.0, 2.0]));
    observed.add(&["hardening"], &told(vec![reported("hardening", 800.0, Vec::new(), true)]));
    assert!(near(observed.sets_at(0.01), [1.0, 1.5]));
    assert!(near(observed.reported(), [0.5, 1.0]));
}

#[test]
fn a_model_that_leaves_something_needs_another_form_as_much_as_the_other_class() {
    let mut observed = Observed::default();
    // e^(-22/11) = 0.135 beside 1; over sqrt(11) it is 0.04, less than 5 % of both.
    let contest = || vec![reported("time-lag", 1000.0, vec![class("low-pass", 978.0)], true)];
    observed.add(&["low-pass"], &told(contest()));
    assert!(near(observed.sets_at(0.01), [0.0, 1.0]));
    let leaves = Unexplained { depends_on: vec!["depth".into()] };
    observed.add(&["low-pass"], &Told { unexplained: leaves, ..told(contest()) });
    assert!(near(observed.sets_at(0.01), [0.5, 1.5]));
}

#[test]
fn a_place_without_the_hidden_class_says_nothing_of_sets_and_shares_are_of_the_right_ones() {
    let mut observed = Observed::default();
    let contests = || {
        told(vec![
            reported("hysteresis", 2000.0, Vec::new(), true),
            reported("surface-offset", 100.0, Vec::new(), true),
            reported("gain-drift", 240.0, Vec::new(), false),
        ])
    };
    observed.add(&["hysteresis"], &contests());
    observed.add(&["hysteresis", "surface-offset"], &contests());
    assert_eq!(observed.places.len(), 3);
    assert_eq!((observed.wrong_shares, observed.right_shares), (vec![0.12], vec![0.05]));
}

#[test]
fn a_class_that_is_ahead_takes_the_place_with_a_smaller_lead() {
    let mut observed = Observed::default();
    let of = |effect, other, ln_odds| told(vec![reported(effect, 100.0, vec![class(other, ln_odds)], true)]);
    observed.add(&["low-pass"], &of("time-lag", "low-pass", 101.5));
    observed.add(&["time-lag"], &of("time-lag", "low-pass", 102.5));
    assert_eq!([1.0, 2.0, 3.0].map(|lead| observed.exchanged_at(lead)), [[1, 1], [1, 0], [0, 0]]);
}

#[test]
fn what_a_name_closes_is_asked_where_it_explains_a_part_and_is_no_drift() {
    let mut observed = Observed::default();
    let of = |effect| told(vec![reported(effect, 100.0, Vec::new(), true)]);
    let partly = |effect| Told { verdict: "partly-explained".into(), ..of(effect) };
    observed.add(&["imprint"], &of("imprint"));
    observed.add(&["gain-drift"], &partly("gain-drift"));
    assert_eq!(observed.closes, []);
    observed.add(&["imprint"], &partly("imprint"));
    observed.add(&[], &partly("relaxation"));
    let given_up = vec![GivenUp { effect: "relaxation".into(), closed_share: Some(0.35) }];
    observed.add(&[], &Told { given_up, ..told(Vec::new()) });
    assert_eq!([0.5, 0.9, 0.95].map(|share| observed.far_at(share)), [[0, 1], [0, 1], [1, 2]]);
    assert!(constants_table(&observed).contains("NEAR_CLOSES, 1 right and 2 wrong names alone"));
}
