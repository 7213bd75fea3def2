use tactus_discover::{Closed, Final, Floor, GlobalTest, Level, Plan, Split, Unexplained, Verdict};
use tactus_model::effect::Definition;
use tactus_schema::Rig;

use super::*;

const RELAXATION: [(&str, f64); 5] = [
    ("relaxed_share", 0.12),
    ("time_constant_s", 8.1),
    ("spread_ratio", 4.0),
    ("after_release", 0.0),
    ("recovery_ratio", 1.0),
];

pub(crate) fn before() -> Model {
    let rig = Rig::from_toml(include_str!("../../../../../config/rigs/sim.toml")).unwrap();
    let mut model = Model::of_rig(&rig).unwrap();
    model.base.noise_rms_counts = 1.5;
    model.effects = vec![KnownEffect {
        effect: Effect::new("relaxation", RELAXATION).unwrap(),
        standard_errors: [("relaxed_share".into(), 0.1)].into(),
        evidence: Some(Evidence {
            data: "earlier".into(),
            heldout_rms_before_counts: 9.0,
            heldout_rms_after_counts: 3.0,
        }),
        version: None,
    }];
    model
}

fn miswired(element: f64, answers_for: f64) -> [(&'static str, f64); 4] {
    [("element", element), ("answers_for", answers_for), ("own_share", 0.0), ("other_share", 0.9)]
}

/// Two elements were found to be miswired, and what was known changed a little.
pub(crate) fn found(model: &Model) -> Discovery {
    let term = |parameters: [(&'static str, f64); 4]| {
        parameters
            .map(|(name, value)| Estimated {
                name,
                value,
                standard_error: (name == "other_share").then_some(0.01),
            })
            .to_vec()
    };
    let level = Level { heldout_rms_counts: 2.0, heldout_chi2: Some(1.0), structured: None };
    let base = tactus_discover::BaseModel {
        psf: model.base.psf,
        response: model.base.response.clone(),
        run_gains: vec![1.0],
        run_baselines_counts: vec![model.base.response.baseline_counts.clone()],
        run_walks: None,
    };
    let mut grown = base.clone();
    grown.psf.sigma_intercept_mm = 2.3;
    Discovery {
        seed: 1,
        not_shown: Vec::new(),
        warnings: Vec::new(),
        split: Split {
            frames: 10,
            train_presses: 4,
            heldout_presses: 2,
            heldout_depths_mm: Vec::new(),
            heldout_coverings_mm: Vec::new(),
        },
        heldout_frames: vec![false; 10],
        floor: Floor::Time { rms_counts: 2.0, freedom: 100.0 },
        tolerance_counts: None,
        faulty: Vec::new(),
        base: level,
        global: Some(GlobalTest { statistic: 9.0, p_value: 0.001 }),
        gap: Vec::new(),
        curves: Vec::new(),
        elements: Vec::new(),
        rounds: Vec::new(),
        tentative: vec![],
        inclusions: vec![],
        contests: vec![],
        steps: vec![AddedEffect {
            effect: "miswired",
            terms: vec![term(miswired(18.0, 19.0)), term(miswired(19.0, 18.0))],
            p_value: 1e-5,
            q_value: 1e-4,
            folds_p_value: Some(1e-4),
            heldout_rms_before_counts: 8.0,
            heldout_rms_after_counts: 2.0,
            curves: Vec::new(),
            equivalent: Vec::new(),
        }],
        final_: Final {
            level,
            closed: Some(Closed { share: 1.0, standard_error: None, most: f64::INFINITY }),
        },
        verdict: Verdict::Explained,
        draft: None,
        unexplained: Unexplained { depends_on: Vec::new(), gap: Vec::new(), share: 0.0 },
        given_up: Vec::new(),
        staircase: Vec::new(),
        plan: Plan::default(),
        recalibrated: base,
        grown,
        effects: vec![
            Effect::new(
                "relaxation",
                [
                    ("relaxed_share", 0.11),
                    ("time_constant_s", 7.0),
                    ("spread_ratio", 4.0),
                    ("after_release", 0.0),
                    ("recovery_ratio", 1.0),
                ],
            )
            .unwrap(),
            Effect::new("miswired", miswired(18.0, 19.0)).unwrap(),
            Effect::new("miswired", miswired(19.0, 18.0)).unwrap(),
        ],
    }
}

#[test]
fn what_was_added_has_errors_and_evidence_and_what_was_known_keeps_its_evidence() {
    let before = before();
    let model = grown(&before, &found(&before), "a, b");
    let [relaxation, one, other] = &model.effects[..] else { panic!("three effects") };
    assert_eq!(relaxation.effect.value("relaxed_share"), Some(0.11));
    assert!(relaxation.standard_errors.is_empty(), "of values that are no more");
    assert_eq!(relaxation.evidence.as_ref().unwrap().data, "earlier");
    for (effect, element) in [(one, 18.0), (other, 19.0)] {
        assert_eq!(effect.effect.value("element"), Some(element));
        assert_eq!(effect.standard_errors, [("other_share".to_owned(), 0.01)].into());
        let evidence = effect.evidence.as_ref().unwrap();
        assert_eq!((evidence.data.as_str(), evidence.heldout_rms_before_counts), ("a, b", 8.0));
    }
    assert_eq!((model.base.psf.sigma_intercept_mm, model.base.noise_rms_counts), (2.3, 2.0));
}

#[test]
fn the_grown_model_loads_again() {
    let before = before();
    let model = grown(&before, &found(&before), "a");
    assert_eq!(Model::from_toml(&model.to_toml().unwrap()).unwrap(), model);
}

#[test]
fn without_repeats_the_noise_stays_as_it_was_said_to_be() {
    let before = before();
    let found = Discovery { floor: Floor::None, ..found(&before) };
    let noise_rms_counts = grown(&before, &found, "a").base.noise_rms_counts;
    assert!((noise_rms_counts - 1.5).abs() < 1e-12);
}

#[test]
fn the_parts_of_a_random_walk_have_the_evidence_of_the_whole() {
    let before = before();
    let mut found = found(&before);
    let part = Effect::neutral(Definition::find("baseline-drift").unwrap());
    let part = part.with("element", 20.0).unwrap().with("offset_01_counts", 0.5).unwrap();
    let whole = vec![Estimated { name: "rms_counts", value: 0.6, standard_error: None }];
    found.steps.push(AddedEffect { effect: "baseline-drift", terms: vec![whole], ..found.steps[0].clone() });
    found.effects.push(part.clone());
    let model = grown(&before, &found, "a");
    let known = model.effects.last().unwrap();
    assert_eq!(known.effect, part);
    assert!(known.evidence.is_some() && known.standard_errors.is_empty());
    assert_eq!(Model::from_toml(&model.to_toml().unwrap()).unwrap(), model);
}
