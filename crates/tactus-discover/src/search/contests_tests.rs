use super::{Contest, Rivalry};

fn is_name(ln_odds: f64, instead: f64, beside: f64) -> bool {
    let rivals = vec![Rivalry { rival: "any", instead, beside }];
    Contest { effect: "gain-drift", ln_odds, rivals, classes: vec![], left: 0.0, kept: true }
        .nearest_form_of()
        .is_none()
}

#[test]
fn a_class_that_leaves_much_to_a_rival_that_acts_like_it_is_no_name() {
    assert!(!is_name(100.0, 80.0, 30.0));
}

#[test]
fn what_a_rival_explains_of_another_physics_takes_no_name_away() {
    // It hardly acts like the class.
    assert!(is_name(100.0, 20.0, 300.0));
}

#[test]
fn a_class_that_leaves_little_keeps_its_name_however_like_it_a_rival_acts() {
    assert!(is_name(1000.0, 990.0, 60.0));
    // Below the odds with which anything is added, a share says nothing.
    assert!(is_name(20.0, 18.0, 4.5));
}
