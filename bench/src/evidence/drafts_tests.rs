use super::super::outcome::tests::set;
use super::*;

fn outside(physics: &str, draft: Option<(&str, &str, f64)>) -> Outcome {
    let mut outcome = set(&[None], &[], "unexplained");
    outcome.truths[0].physics = physics.into();
    outcome.draft = draft.map(|(stage, covariate, closed)| Draft {
        stage: stage.into(),
        covariates: vec![Covariate { covariate: covariate.into() }],
        closed_share: Some(closed),
        curve: None,
    });
    outcome
}

/// The same with a relative error of the curve.
fn curved(covariate: &str, error: Option<f64>) -> Outcome {
    let mut outcome = outside("supply-droop", Some(("element", covariate, 0.9)));
    if let Some(draft) = &mut outcome.draft {
        draft.curve = Some(Curve { draft: String::new(), error });
    }
    outcome
}

#[test]
fn a_draft_is_right_by_its_stage_and_its_covariate_and_all_sets_count() {
    let sets = [
        outside("supply-droop", Some(("element", "sum of signals", 0.9))),
        outside("supply-droop", Some(("covering", "sum of signals", 0.5))),
        outside("supply-droop", Some(("element", "depth", 0.9))),
        outside("stage-pickup", None),
        outside("bit-flips", Some(("readout", "time", 0.9))),
    ];
    let sets: Vec<&Outcome> = sets.iter().collect();
    let scores = DraftScores::new(&[], &[], &sets);
    let all = &scores.outside["all"];
    assert_eq!((all.drafted.hits, all.right.hits, all.right_and_closed.hits, all.right.of), (3, 2, 1, 4));
    assert_eq!((scores.outside["stage-pickup"].drafted.hits, scores.of_single.hits), (0, 1));
}

#[test]
fn a_curve_is_near_within_a_tenth_if_its_draft_is_right_and_all_sets_count() {
    let right = |error: Option<f64>| curved("sum of signals", error);
    let sets = [
        right(Some(0.04)),
        right(Some(0.06)),
        right(Some(0.3)),
        right(None),
        curved("depth", Some(0.01)),
        outside("supply-droop", None),
    ];
    let curves = |sets: &[Outcome]| {
        let sets: Vec<&Outcome> = sets.iter().collect();
        DraftScores::new(&[], &[], &sets).outside["all"].curves
    };
    let all = curves(&sets);
    assert_eq!(all.map(|all| (all.right_and_near.hits, all.right_and_near.of)), Some((2, 6)));
    // Between 0.06 and 0.3; what does not show on the other path is beyond.
    let median = all.and_then(|all| all.median_error);
    assert!(median.is_some_and(|median| (median - 0.18).abs() < 1e-12), "{median:?}");
    let [first, ..] = sets;
    let not_computed = outside("supply-droop", Some(("element", "sum of signals", 0.9)));
    assert!(curves(&[first, not_computed]).is_none());
}
