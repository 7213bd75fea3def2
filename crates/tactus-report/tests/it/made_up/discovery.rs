//! Synthetic discoveries with known numbers.

use tactus_discover::{
    AddedEffect, BaseModel, Because, Closed, Contest, Curve, Discovery, DraftedEffect, ElementGap, Estimated,
    FaultKind, FaultyElement, Final, Floor, Gap, GivenUp, GlobalTest, Inclusion, LeftOut, Level,
    NextExperiment, NotShown, OpenQuestion, Plan, Point, Rivalry, Round, Split, Stair, Structured,
    TriedEffect, Unexplained, Verdict,
};
use tactus_model::effect::{Carrier, Draft, Law, When};
use tactus_model::{Array, Covariate, Covering, Effect, Indenter, Psf, Response};
use tactus_report::discovery::{DataSource, DiscoveryReport};

const NOISE_COUNTS: f64 = 2.0;
const COVARIATES: [(&str, &str, [f64; 2]); 12] = [
    ("time", "s", [0.0, 1200.0]),
    ("time since contact", "s", [0.0, 30.0]),
    ("time since release", "s", [0.0, 60.0]),
    ("depth", "mm", [0.0, 0.7]),
    ("largest past depth", "mm", [0.1, 0.7]),
    ("speed", "mm/s", [-2.0, 2.0]),
    ("press", "", [0.0, 120.0]),
    ("place x", "mm", [0.0, 15.8]),
    ("place y", "mm", [0.0, 11.8]),
    ("place in the element x", "mm", [-1.0, 1.0]),
    ("neighbours' signal", "counts", [0.0, 800.0]),
    ("temperature", "deg C", [21.0, 24.0]),
];

/// A draft with every kind of field filled: a law that passes through knots.
pub(crate) fn draft() -> DraftedEffect {
    DraftedEffect {
        draft: Draft {
            name: "draft-1".into(),
            sentence:
                "While the tool touches, the signal changes by a share <that> follows the sum of signals"
                    .into(),
            carrier: Carrier::OwnSignal,
            when: When::InContact,
            covariates: vec![Covariate::SumOfSignals],
            ranges: vec![[0.0, 4.0]],
            law: Law::Power { scale: -0.0125, exponent: 2.0 },
            weights: None,
        },
        covariance: vec![vec![1e-6]],
        knots: vec![[0.5, -0.003, 0.001], [2.0, -0.05, 0.002], [4.0, -0.2, f64::NAN]],
        p_value: 0.000_5,
        ln_odds: 244.4,
        folds: 5,
        nearest: vec![("saturation", 76.2), ("hardening", 98.0)],
        alike: vec!["depth in contact, by temperature".into()],
        closed: Some(Closed { share: 0.93, standard_error: Some(0.04), most: 1.01 }),
        heldout_rms_before_counts: 3.45,
        heldout_rms_after_counts: 2.11,
        base: base(),
        effects: vec![],
    }
}

/// Two effects were found, one of them twice; a third was known before.
pub(crate) fn explained() -> Discovery {
    let (hysteresis, miswired) =
        (["loss_share", "threshold_mm"], ["element", "answers_for", "own_share", "other_share"]);
    Discovery {
        seed: 7,
        not_shown: vec![
            lacks("gain-drift", "temperature was not measured, and all presses lie within 20 s"),
            lacks("softening", "no press is followed by a shallower one in the same place"),
            lacks("imprint", "no press is followed by a shallower one in the same place"),
        ],
        warnings: vec!["3 % of the frames are saturated and were left out".into()],
        split: Split {
            frames: 36_000,
            train_presses: 96,
            heldout_presses: 24,
            heldout_depths_mm: vec![0.45],
            heldout_coverings_mm: vec![2.54],
        },
        heldout_frames: vec![false; 36_000],
        floor: Floor::Time { rms_counts: NOISE_COUNTS, freedom: 1000.0 },
        tolerance_counts: Some(2.5),
        faulty: vec![],
        base: level(9.36),
        global: Some(GlobalTest { statistic: 41.2, p_value: 0.000_5 }),
        gap: vec![
            gap("time since contact", "s", [0.4, 30.0], 3.81, 1e-9),
            gap("depth", "mm", [0.45, 0.7], 1.24, 0.002_4),
        ],
        curves: COVARIATES.iter().enumerate().map(|(nth, covariate)| curve(nth, *covariate)).collect(),
        elements: (0..48)
            .map(|element| ElementGap {
                before_rms_counts: 4.0 + 0.25 * f64::from(element),
                after_rms_counts: 2.0 + 0.01 * f64::from(element),
            })
            .collect(),
        rounds: rounds(),
        given_up: vec![GivenUp { effect: "gain-drift", because: Because::Other("hysteresis") }],
        staircase: [("base model", 9.36), ("misregistration", 9.2), ("hysteresis", 4.31), ("miswired", 2.08)]
            .map(|(with, heldout_rms_counts)| Stair { with: with.into(), heldout_rms_counts })
            .to_vec(),
        tentative: vec![],
        inclusions: inclusions(),
        contests: contests(),
        steps: vec![
            AddedEffect {
                effect: "hysteresis",
                terms: vec![vec![
                    estimated(hysteresis[0], 0.123_4, Some(0.004_1)),
                    estimated(hysteresis[1], 0.051, Some(0.002)),
                ]],
                p_value: 3e-7,
                q_value: 0.001_7,
                folds_p_value: Some(0.000_5),
                heldout_rms_before_counts: 9.12,
                heldout_rms_after_counts: 2.08,
                curves: Vec::new(),
                equivalent: vec!["backlash"],
            },
            AddedEffect {
                effect: "miswired",
                terms: [[18.0, 19.0], [19.0, 18.0]]
                    .map(|[element, answers_for]| {
                        vec![
                            estimated(miswired[0], element, None),
                            estimated(miswired[1], answers_for, None),
                            estimated(miswired[2], 0.01, Some(0.003)),
                            estimated(miswired[3], 0.97, Some(0.004)),
                        ]
                    })
                    .to_vec(),
                p_value: 0.000_02,
                q_value: 0.000_3,
                folds_p_value: Some(0.000_5),
                heldout_rms_before_counts: 4.31,
                heldout_rms_after_counts: 2.08,
                curves: Vec::new(),
                equivalent: vec![],
            },
        ],
        final_: Final {
            level: level(2.08),
            closed: Some(Closed { share: 0.996_1, standard_error: Some(0.004), most: 1.004 }),
        },
        verdict: Verdict::Explained,
        draft: None,
        unexplained: Unexplained { depends_on: vec![], gap: vec![], share: 0.003_9 },
        plan: plan(),
        recalibrated: base(),
        grown: base(),
        effects: vec![
            Effect::new("misregistration", neutral("misregistration")).unwrap(),
            Effect::new("hysteresis", neutral("hysteresis"))
                .and_then(|effect| effect.with(hysteresis[0], 0.123_4))
                .and_then(|effect| effect.with(hysteresis[1], 0.051))
                .unwrap(),
        ],
    }
}

fn inclusions() -> Vec<Inclusion> {
    [("hysteresis", 0.93), ("relaxation", 0.12), ("saturation", 0.031)]
        .map(|(effect, probability)| Inclusion { effect, probability })
        .to_vec()
}

/// A rival that gains nothing has no odds.
fn plan() -> Plan {
    Plan {
        next: vec![NextExperiment {
            experiment: "diagnose".into(),
            parameters: vec![("parts", "approach".into())],
            seed: 2_718_281_828,
            duration_s: 60.0,
            separates: ["hysteresis".into(), "backlash".into()],
            expected_z: Some(11.3),
        }],
        open: vec![OpenQuestion { separates: ["miswired".into(), "crosstalk".into()], best: None }],
        left_out: vec![LeftOut {
            experiment: "lab/deep.star".into(),
            parameters: vec![],
            reason: "deep.star:7: no sample".into(),
        }],
    }
}

fn contests() -> Vec<Contest> {
    let rivalry = |rival, instead, beside| Rivalry { rival, instead, beside };
    let rivals =
        vec![rivalry("sum of signals", 412.5, 3.25), rivalry("tone in counts", f64::NEG_INFINITY, -4.5)];
    let classes = vec![("backlash", 1511.5)];
    vec![Contest { effect: "hysteresis", ln_odds: 1530.25, rivals, classes, left: 0.75, kept: true }]
}

/// Nothing is missing from the base model.
pub(crate) fn nothing_missing() -> Discovery {
    let flat = |mut curve: Curve| {
        for point in &mut curve.points {
            (point.before, point.after) = (0.1 * point.before, 0.1 * point.before);
        }
        curve
    };
    let whole = explained();
    Discovery {
        not_shown: vec![],
        warnings: vec![],
        base: level(2.01),
        global: Some(GlobalTest { statistic: 2.4, p_value: 0.431 }),
        tolerance_counts: None,
        gap: vec![],
        curves: whole.curves.into_iter().map(flat).collect(),
        elements: vec![ElementGap { before_rms_counts: 2.0, after_rms_counts: 2.0 }; 48],
        rounds: vec![],
        steps: vec![],
        tentative: vec![],
        inclusions: vec![],
        contests: vec![],
        final_: Final { level: level(2.01), closed: None },
        verdict: Verdict::NothingMissing,
        given_up: vec![],
        staircase: vec![Stair { with: "base model".into(), heldout_rms_counts: 2.02 }],
        unexplained: Unexplained { depends_on: vec![], gap: vec![], share: 0.0 },
        plan: Plan::default(),
        effects: vec![],
        ..whole
    }
}

/// Two elements are dead, one is stuck, one is noisy, and one gives another's signal; nothing else is missing.
pub(crate) fn faulty() -> Discovery {
    let fault = |element, kind, evidence: &str| FaultyElement { element, kind, evidence: evidence.into() };
    let whole = explained();
    let mut elements = vec![ElementGap { before_rms_counts: 2.0, after_rms_counts: 2.0 }; 48];
    for element in [5, 12, 30, 39] {
        elements[element] = ElementGap { before_rms_counts: f64::NAN, after_rms_counts: f64::NAN };
    }
    Discovery {
        faulty: vec![
            fault(5, FaultKind::Dead, "rises by -0.4 +- 3.9 counts per mm"),
            fault(12, FaultKind::Stuck { counts: 812.0 }, "reads 812 in each of 36000 frames"),
            fault(18, FaultKind::CrossWired { answers_for: 19 }, "follows the prediction for element 19"),
            fault(30, FaultKind::Noisy { rms_counts: 31.4 }, "31.4 counts rms at rest"),
            fault(39, FaultKind::Dead, "rises by 2.0 +- 3.3 counts per mm"),
        ],
        elements,
        steps: whole.steps[1..].to_vec(),
        tentative: vec![],
        verdict: Verdict::Explained,
        effects: vec![],
        ..nothing_missing()
    }
}

/// There is a gap that no candidate closes; the noise is known from repeats of a place.
pub(crate) fn unexplained() -> Discovery {
    let whole = explained();
    Discovery {
        floor: Floor::Repeats { rms_counts: NOISE_COUNTS, freedom: 12.0 },
        tolerance_counts: None,
        final_: Final {
            level: whole.base,
            closed: Some(Closed { share: 0.0, standard_error: None, most: f64::INFINITY }),
        },
        rounds: vec![Round {
            with: vec![],
            taken: None,
            rival: Some("place along x"),
            ..whole.rounds[0].clone()
        }],
        steps: vec![],
        tentative: vec![],
        inclusions: vec![],
        contests: vec![],
        verdict: Verdict::Unexplained,
        given_up: vec![GivenUp { effect: "hysteresis", because: Because::Rival("place along x") }],
        staircase: vec![Stair { with: "base model".into(), heldout_rms_counts: 9.36 }],
        unexplained: Unexplained {
            depends_on: vec!["time since contact", "depth"],
            gap: whole.gap.clone(),
            share: 1.0,
        },
        plan: Plan::default(),
        effects: vec![],
        ..whole
    }
}

/// Nothing repeats.
pub(crate) fn cannot_judge() -> Discovery {
    let level = Level { heldout_rms_counts: 54.0, heldout_chi2: None, structured: None };
    Discovery {
        floor: Floor::None,
        global: None,
        base: level,
        final_: Final { level, closed: None },
        verdict: Verdict::CannotJudge,
        staircase: vec![],
        unexplained: Unexplained { depends_on: vec![], gap: vec![], share: 1.0 },
        curves: vec![],
        plan: Plan {
            next: vec![NextExperiment {
                experiment: "diagnose".into(),
                parameters: vec![("parts", "drift,repeats".into())],
                seed: 1,
                duration_s: 270.0,
                separates: ["what is missing".into(), "noise".into()],
                expected_z: None,
            }],
            ..Plan::default()
        },
        ..nothing_missing()
    }
}

/// Empty, with NaN wherever possible.
pub(crate) fn empty() -> Discovery {
    let structured = Structured { rms_noise: f64::NAN, upper_noise: f64::INFINITY, with_signal: true };
    let nowhere =
        Level { heldout_rms_counts: f64::NAN, heldout_chi2: Some(f64::NAN), structured: Some(structured) };
    Discovery {
        floor: Floor::None,
        split: Split {
            frames: 0,
            train_presses: 0,
            heldout_presses: 0,
            heldout_depths_mm: vec![],
            heldout_coverings_mm: vec![],
        },
        base: nowhere,
        global: Some(GlobalTest { statistic: f64::NAN, p_value: f64::NAN }),
        curves: vec![],
        elements: vec![],
        final_: Final { level: nowhere, closed: None },
        ..nothing_missing()
    }
}

pub(crate) fn data() -> Vec<DataSource> {
    vec![
        DataSource { id: "diagnose-1".into(), sha256: "4f1c".repeat(16), frames: 20_000, presses: 70 },
        DataSource { id: "grid-sweep-2".into(), sha256: "90ab".repeat(16), frames: 16_000, presses: 50 },
    ]
}

pub(crate) fn report<'a>(
    array: &'a Array,
    data: &'a [DataSource],
    discovery: &'a Discovery,
) -> DiscoveryReport<'a> {
    DiscoveryReport {
        rig: "sim",
        simulated: true,
        array,
        data,
        notes: &[],
        active: &[],
        active_ended: None,
        settled: &[],
        lab: &[],
        discovery,
    }
}

fn rounds() -> Vec<Round> {
    vec![
        Round {
            with: vec!["misregistration"],
            candidates: vec![
                tried("hysteresis", 39.4, 0.000_5, Some((4.31, 0.823))),
                tried("low-pass", 12.1, 0.000_5, Some((8.77, 0.126))),
                tried("hardening", 3.2, 0.41, None),
                tried("crosstalk", 1.1, 1.0, None),
            ],
            taken: Some("hysteresis"),
            rival: None,
        },
        Round {
            with: vec!["misregistration"],
            candidates: vec![tried("gain-drift", 30.1, 0.000_5, Some((6.0, 0.61)))],
            taken: Some("gain-drift"),
            rival: None,
        },
        Round {
            with: vec!["misregistration", "hysteresis"],
            candidates: vec![
                tried("miswired", 22.0, 0.000_5, Some((2.08, 0.996))),
                tried("hardening", 2.2, 0.93, None),
            ],
            taken: Some("miswired"),
            rival: None,
        },
        Round {
            with: vec!["misregistration", "hysteresis", "miswired"],
            candidates: vec![tried("hardening", 1.9, 0.97, None)],
            taken: None,
            rival: None,
        },
    ]
}

fn level(rms_counts: f64) -> Level {
    let variance_noise2 = (rms_counts / NOISE_COUNTS).powi(2);
    let rms_noise = (variance_noise2 - 1.0).sqrt();
    Level {
        heldout_rms_counts: rms_counts,
        heldout_chi2: Some(variance_noise2),
        structured: Some(Structured { rms_noise, upper_noise: 1.25 * rms_noise, with_signal: true }),
    }
}

fn lacks(effect: &'static str, reason: &str) -> NotShown {
    NotShown { effect, reason: reason.into() }
}

fn gap(covariate: &'static str, unit: &'static str, range: [f64; 2], effect_size: f64, q_value: f64) -> Gap {
    Gap { covariate, unit, element: None, range, effect_size, q_value }
}

fn tried(effect: &'static str, score: f64, p_value: f64, fitted: Option<(f64, f64)>) -> TriedEffect {
    TriedEffect {
        effect,
        score,
        p_value,
        heldout_rms_counts: fitted.map(|(rms, _)| rms),
        shrink: fitted.map(|(_, shrink)| shrink),
    }
}

fn estimated(name: &'static str, value: f64, standard_error: Option<f64>) -> Estimated {
    Estimated { name, value, standard_error }
}

fn curve(nth: usize, (covariate, unit, [from, to]): (&'static str, &'static str, [f64; 2])) -> Curve {
    let points = (0..16).map(|step| {
        let share = (f64::from(step) + 0.5) / 16.0;
        let wave = (3.0 * share + nth as f64).sin();
        Point {
            at: from + share * (to - from),
            before: 0.04 * wave,
            after: 0.002 * (7.0 * share + nth as f64).cos(),
            standard_error: 0.002 + 0.001 * share,
        }
    });
    let of = if nth % 3 == 2 { "counts" } else { "share of the signal" };
    Curve { covariate, unit, of, points: points.collect() }
}

fn neutral(name: &str) -> Vec<(&'static str, f64)> {
    let definition = tactus_model::effect::Definition::find(name).unwrap();
    Effect::neutral(definition).parameters().collect()
}

fn base() -> BaseModel {
    BaseModel {
        psf: Psf::PAPER,
        response: Response {
            sensitivity_counts_per_mm: vec![1000.0; 48],
            baseline_counts: vec![100.0; 48],
            quadratic_per_mm: vec![0.0; 48],
            reference_indenter: Indenter::Cylinder { diameter_mm: 1.0 },
            reference_covering: Covering { thickness_mm: 1.016 },
        },
        run_gains: vec![1.0],
        run_baselines_counts: vec![vec![100.0; 48]],
        run_walks: None,
    }
}
