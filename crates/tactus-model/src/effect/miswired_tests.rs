#![expect(clippy::float_cmp, reason = "these values are exact")]

use crate::effect::bench::{effect, simulator, still, upon};
use crate::{Effect, Pipeline};

fn wired(element: f64, answers_for: f64, own_share: f64, other_share: f64) -> Effect {
    let shares = [("own_share", own_share), ("other_share", other_share)];
    effect("miswired", [("element", element), ("answers_for", answers_for), shares[0], shares[1]])
}

#[test]
fn a_dead_element_reads_its_baseline() {
    let dead = simulator([wired(21.0, 0.0, 0.0, 0.0)]);
    let counts = still(&dead, upon(&dead, 21, 0.5));
    assert!(counts[21] == 100.0 && counts[20] > 200.0);
}

#[test]
fn two_elements_that_are_exchanged_each_answer_for_the_other_in_either_order() {
    let (one, other) = (wired(18.0, 19.0, 0.0, 1.0), wired(19.0, 18.0, 0.0, 1.0));
    let tip_mm = upon(&simulator([]), 18, 0.5);
    // With one response for all, exchanged elements exchange their counts.
    let alike = |effects: &[&Effect]| {
        let mut one = simulator(effects.iter().copied().cloned());
        let mut response = one.model.response().clone();
        response.sensitivity_counts_per_mm = vec![1000.0; 48];
        one.model = crate::ForwardModel::new(one.model.array().clone(), one.model.psf(), response).unwrap();
        still(&one, tip_mm)
    };
    let mut want = alike(&[]);
    want.swap(18, 19);
    assert_eq!(alike(&[&one, &other]), want);
    assert_eq!(alike(&[&other, &one]), want);
}

#[test]
fn an_element_that_is_not_there_makes_no_pipeline() {
    assert!(Pipeline::new(&simulator([wired(48.0, 0.0, 1.0, 0.0)])).is_err());
}
