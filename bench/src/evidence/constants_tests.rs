use super::super::contests::Class;
use super::*;

fn class(effect: &str, ln_odds: f64) -> Class {
    Class { effect: effect.into(), ln_odds }
}

fn reported(effect: &str, ln_odds: f64, classes: Vec<Class>, kept: bool) -> Reported {
    Reported { effect: effect.into(), ln_odds, rivals: Vec::new(), classes, left_ln_odds: 0.0, kept }
}

fn near(found: [f64; 2], wanted: [f64; 2]) -> bool {
    found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-12)
}

#[test]
fn a_hidden_class_that_is_behind_is_held_once_forms_may_mislead_by_as_much() {
    let mut observed = Observed::default();
    let behind = vec![class("low-pass", 990.0), class("relaxation", 500.0)];
    observed.add(&["low-pass"], &[reported("time-lag", 1000.0, behind, true)]);
    // e^-10 beside 1, then e^(-10/11) / sqrt(11) = 0.12 beside 1.
    assert!(near(observed.sets_at(0.0), [0.0, 1.0]));
    assert!(near(observed.sets_at(0.01), [1.0, 2.0]));
    observed.add(&["hardening"], &[reported("hardening", 800.0, Vec::new(), true)]);
    assert!(near(observed.sets_at(0.01), [1.0, 1.5]));
}

#[test]
fn a_place_without_the_hidden_class_says_nothing_of_sets_and_shares_are_of_the_right_ones() {
    let mut observed = Observed::default();
    let contests = [
        reported("hysteresis", 2000.0, Vec::new(), true),
        reported("surface-offset", 100.0, Vec::new(), true),
        reported("gain-drift", 240.0, Vec::new(), false),
    ];
    observed.add(&["hysteresis"], &contests);
    observed.add(&["hysteresis", "surface-offset"], &contests);
    assert_eq!(observed.places.len(), 3);
    assert_eq!((observed.wrong_shares, observed.right_shares), (vec![0.12], vec![0.05]));
}
