use tactus_discover::{DraftedEffect, NextExperiment, Plan};
use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Draft, Law, When};

use super::*;
use crate::commands::discover::model::tests::{before, found};

fn draft(name: &str) -> Draft {
    Draft {
        name: name.into(),
        sentence: "counts are added".into(),
        carrier: Carrier::Counts,
        when: When::InContact,
        covariates: vec![Covariate::Depth],
        ranges: vec![[0.0, 0.6]],
        law: Law::Linear { offset: 3.0, slope: 0.0 },
        weights: None,
    }
}

/// A discovery with a draft, which an experiment would measure anew.
fn with_draft() -> Discovery {
    let found = found(&before());
    let effect = Effect::neutral(draft("draft-1").define().unwrap()).with(STRENGTH, 1.0).unwrap();
    let drafted = DraftedEffect {
        draft: draft("draft-1"),
        covariance: Vec::new(),
        knots: Vec::new(),
        p_value: 0.0005,
        ln_odds: 100.0,
        folds: 5,
        nearest: Vec::new(),
        alike: Vec::new(),
        closed: None,
        heldout_rms_before_counts: 3.0,
        heldout_rms_after_counts: 2.0,
        base: found.grown.clone(),
        effects: vec![effect],
    };
    let next = NextExperiment {
        experiment: "diagnose".into(),
        parameters: Vec::new(),
        seed: 1,
        duration_s: 30.0,
        separates: ["draft-1".into(), "noise".into()],
        expected_z: Some(30.0),
    };
    let plan = Plan { next: vec![next], ..Plan::default() };
    Discovery { draft: Some(Ok(Box::new(drafted))), plan, ..found }
}

#[test]
fn the_draft_that_follows_a_refuted_one_has_another_name_everywhere() {
    let mut found = with_draft();
    let tried = draft("draft-2").define().unwrap();
    renumber(&mut found, &["draft-1".to_owned()], &[tried]).unwrap();
    let Some(Ok(drafted)) = &found.draft else { panic!("a draft") };
    assert_eq!(drafted.draft.name, "draft-3", "draft-2 is one of those that were tried");
    assert_eq!((drafted.effects[0].name(), drafted.effects[0].value(STRENGTH)), ("draft-3", Some(1.0)));
    assert_eq!(found.plan.next[0].separates, ["draft-3", "noise"]);
}

#[test]
fn a_draft_whose_name_is_free_keeps_it() {
    let mut found = with_draft();
    renumber(&mut found, &["draft-7".to_owned()], &[]).unwrap();
    let Some(Ok(drafted)) = &found.draft else { panic!("a draft") };
    assert_eq!(drafted.draft.name, "draft-1");
}
