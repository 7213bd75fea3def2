use super::super::outcome::tests::set;
use super::*;

fn outside(physics: &str, draft: Option<(&str, &str, f64)>) -> Outcome {
    let mut outcome = set(&[None], &[], "unexplained");
    outcome.truths[0].physics = physics.into();
    outcome.draft = draft.map(|(stage, covariate, closed)| Draft {
        stage: stage.into(),
        covariates: vec![Covariate { covariate: covariate.into() }],
        closed_share: Some(closed),
    });
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
