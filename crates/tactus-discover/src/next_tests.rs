use tactus_model::effect::{Carrier, Draft, Law, When};
use tactus_model::{Covariate, Registration};
use tactus_schema::table::{Phase, RowView};

use super::catalogue::{ELEMENT_DEPTHS_MM, SPEEDS_MM_PER_S, SWEEP_SHARES};
use super::*;
use crate::fixtures::{self, ShippedRig};
use crate::search::not_shown;

/// A sensor that lies where the sample rig has it.
fn known() -> Known {
    Known { registration: Registration { origin_mm: [20.0, 15.0], rotation_deg: 0.0 }, ..fixtures::known() }
}

/// One press to 0.6 mm at 1 mm/s, under the paper's thinnest covering.
fn measured() -> Frames {
    loaded(1.0)
}

fn loaded(mm_per_s: f64) -> Frames {
    let mut frames = Frames::new(48);
    for frame in 0..60 {
        let t_s = f64::from(frame) / 30.0;
        frames.push(RowView {
            run: "r",
            press: 0,
            phase: Phase::Load,
            t_ns: i64::from(frame) * 33_333_333,
            position_mm: [25.0, 20.0, (0.3 - mm_per_s * t_s).max(-0.6)],
            covering_mm: 1.016,
            indenter: "cyl1",
            temperature_c: None,
            counts: &[100.0; 48],
        });
    }
    frames
}

fn planner<'a>(
    known: &'a Known,
    frames: &'a Frames,
    noise: &'a Noise,
    experiments: &'a ShippedRig,
) -> Planner<'a> {
    Planner { known, frames, noise, faulty: &[], experiments, seed: 1 }
}

/// A plan for pairs that data of [`measured`] leave open.
fn planned(pairs: &[Pair], experiments: &ShippedRig) -> Plan {
    let (known, frames, noise) = (known(), measured(), noise());
    let at = Parameters::declared(&known, 1);
    let open = Open { pairs, not_shown: &[], at: &at, draft: None, lacks_repeats: false };
    planner(&known, &frames, &noise, experiments).plan(open).unwrap()
}

#[test]
fn the_defaults_are_the_scripts_own() {
    for (script, default) in [
        (include_str!("../../../experiments/diagnose.star"), &SPEEDS_MM_PER_S[..]),
        (include_str!("../../../experiments/element-centres.star"), &ELEMENT_DEPTHS_MM[..]),
        (include_str!("../../../experiments/grid-sweep.star"), &SWEEP_SHARES[..]),
    ] {
        assert!(script.contains(&format!("default = {default:?},")), "{default:?}");
    }
}

/// Clearly more than [`WORTH_Z`].
const CLEAR_Z: f64 = 8.0;

fn noise() -> Noise {
    Noise {
        rms_counts: 2.0,
        by_element_counts: vec![2.0; 48],
        correlation: vec![1.0],
        rounding_share: 0.0,
        repeated_frames: 1.0,
    }
}

fn explanation(known: &Known, name: &'static str, values: &[(&str, f64)]) -> Explanation {
    let mut parameters = Parameters::declared(known, 1);
    let mut term = Term::neutral(Definition::find(name).unwrap());
    for (parameter, value) in values {
        let place = term.definition.parameters.iter().position(|one| one.name == *parameter).unwrap();
        term.values[place] = *value;
    }
    parameters.terms.push(term);
    Explanation { name, parameters }
}

/// An explanation, and another fitted to its prediction of the paper's experiment: twins in that experiment.
fn twins(known: &Known, [right, wrong]: [(&'static str, &[(&str, f64)]); 2]) -> Pair {
    let (frames, noise, rig) = (measured(), noise(), ShippedRig::new(1.0));
    let [right, wrong] = [right, wrong].map(|(name, values)| explanation(known, name, values));
    let rehearsals = Rehearsals::of(planner(known, &frames, &noise, &rig));
    let frames = &rehearsals.designs(|one| one.name == "element-centres")[0].rehearsal.frames;
    let mut bins = Bins::of(frames, Averaged::Rests).unwrap();
    let all = HeldOut { frames: vec![false; frames.len()], ..HeldOut::default() };
    bins.weigh(frames, &noise, &all);
    bins.counts = Predictor::new(known, frames, &bins).predict(&right.parameters).unwrap();
    let problem = Problem::new(Predictor::new(known, frames, &bins), &noise);
    let fitted = problem.fit_from(wrong.parameters, 8).unwrap();
    let without = Parameters::declared(known, 1);
    let gain = problem.cost(&problem.predict(&without).unwrap());
    Pair { of: [right, Explanation { parameters: fitted.parameters, name: wrong.name }], without, gain }
}

/// How well each of the named designs distinguishes twins.
fn separations<const N: usize>(of: [(&'static str, &[(&str, f64)]); 2], names: [&str; N]) -> [f64; N] {
    let (known, frames, noise, rig) = (known(), measured(), noise(), ShippedRig::new(1.0));
    let planner = planner(&known, &frames, &noise, &rig);
    let pair = twins(&known, of);
    let rehearsals = Rehearsals::of(planner);
    names.map(|name| {
        let designs = rehearsals.designs(|one| one.name == name);
        planner.separation(&designs[0], &pair).unwrap().z
    })
}

#[test]
fn relaxation_and_imprint_are_distinguished_by_rests_and_not_by_quick_presses() {
    let [rests, hold, repeats, approach] = separations(
        [
            ("imprint", &[("set_share", 0.05), ("recovery_s", 5.0)]),
            ("relaxation", &[("relaxed_share", 0.05), ("time_constant_s", 5.0)]),
        ],
        ["rests", "hold", "repeats", "approach"],
    );
    assert!(rests.min(hold) > 1.5 * repeats.max(approach));
    assert!(rests > CLEAR_Z);
}

#[test]
fn misregistration_and_tilt_are_distinguished_by_light_and_deep_presses() {
    let [depths, drift] = separations(
        [("misregistration", &[("offset_x_mm", 0.05)]), ("surface-tilt", &[("slope_x_mm_per_mm", 0.002)])],
        ["depths", "drift"],
    );
    assert!(depths > CLEAR_Z && drift < WORTH_Z);
}

#[test]
fn a_heavy_tail_and_crosstalk_are_distinguished_by_presses_all_over() {
    let [wide, rates, drift] = separations(
        [("heavy-tail", &[("tail_share", 0.05)]), ("crosstalk", &[("neighbour_share", 0.02)])],
        ["wide", "rates", "drift"],
    );
    assert!(wide > CLEAR_Z && wide > rates && drift < WORTH_Z);
}

#[test]
fn lost_motion_and_hysteresis_are_distinguished_by_reversals() {
    let [reversals, repeats, tilt] = separations(
        [
            ("backlash", &[("play_z_mm", 0.03)]),
            ("hysteresis", &[("loss_share", 0.1), ("threshold_mm", 0.03)]),
        ],
        ["reversals", "repeats", "tilt"],
    );
    assert!(reversals > CLEAR_Z && reversals > repeats.max(tilt));
}

const DENT_OR_RELAXATION: [(&str, &[(&str, f64)]); 2] = [
    ("imprint", &[("set_share", 0.05), ("recovery_s", 5.0)]),
    ("relaxation", &[("relaxed_share", 0.05), ("time_constant_s", 5.0)]),
];

#[test]
fn the_greatest_share_comes_first_and_experiments_with_less_are_shorter() {
    let (known, frames, noise, rig) = (known(), measured(), noise(), ShippedRig::new(1.0));
    let planner = planner(&known, &frames, &noise, &rig);
    let pair = twins(&known, DENT_OR_RELAXATION);
    let rehearsals = Rehearsals::of(planner);
    let designs = rehearsals.designs(|_| true);
    let share = |proposal: &NextExperiment| {
        let design = designs.iter().find(|design| {
            (&design.of.experiment, &design.of.parameters) == (&proposal.experiment, &proposal.parameters)
        });
        planner.separation(design.unwrap(), &pair).unwrap().share
    };
    let plan = planned(std::slice::from_ref(&pair), &rig);
    let proposals = &plan.next;
    assert!(!proposals.is_empty() && proposals.len() <= PROPOSALS_MAX);
    assert_eq!((&plan.open[..], &plan.left_out[..]), (&[][..], &[][..]));
    assert_eq!(proposals[0].separates, ["imprint", "relaxation"]);
    let shares: Vec<f64> = proposals.iter().map(share).collect();
    assert!(shares.iter().rev().is_sorted(), "{shares:?}");
    assert!(proposals.windows(2).all(|pair| pair[1].duration_s < pair[0].duration_s), "{proposals:?}");
    let shown_by = ["imprint", "relaxation"].map(|name| Definition::find(name).unwrap().shown_by).concat();
    let greatest = designs
        .iter()
        .filter(|design| shown_by.contains(&design.of.name.as_str()))
        .map(|design| planner.separation(design, &pair).unwrap().share)
        .fold(0.0, f64::max);
    assert!((shares[0] - greatest).abs() < 1e-12, "{shares:?} of {greatest}");
}

#[test]
fn between_an_explanation_and_itself_nothing_is_proposed_and_the_question_stays_open() {
    let known = known();
    let one = explanation(&known, "relaxation", &[("relaxed_share", 0.1)]);
    let pair = Pair { of: [one.clone(), one], without: Parameters::declared(&known, 1), gain: 100.0 };
    let plan = planned(&[pair], &ShippedRig::new(1.0));
    assert_eq!(plan.next, []);
    let [OpenQuestion { separates, best: Some(best) }] = &plan.open[..] else { panic!("{:?}", plan.open) };
    assert_eq!(separates, &["relaxation", "relaxation"]);
    assert!(best.expected_z < Some(1e-6), "{best:?}");
}

#[test]
fn an_effect_that_the_data_cannot_show_gets_an_experiment_of_its_own() {
    let (known, frames, noise, rig) = (known(), measured(), noise(), ShippedRig::new(1.0));
    let not_shown = [NotShown { effect: "relaxation", reason: "no depth was held".into() }];
    let at = Parameters::declared(&known, 1);
    let open = Open { pairs: &[], not_shown: &not_shown, at: &at, draft: None, lacks_repeats: false };
    let plan = planner(&known, &frames, &noise, &rig).plan(open).unwrap();
    let [one] = &plan.next[..] else { panic!("one proposal: {plan:?}") };
    assert_eq!(
        (&*one.experiment, one.separates.clone()),
        ("diagnose", ["relaxation".into(), "nothing".into()])
    );
}

/// A draft of the lab by temperature, which these data do not have.
#[test]
fn a_draft_that_no_experiment_would_show_is_an_open_question() {
    let draft = Draft {
        name: "range-switch".into(),
        sentence: "The signal changes with temperature".into(),
        carrier: Carrier::OwnSignal,
        when: When::InContact,
        covariates: vec![Covariate::Temperature],
        ranges: vec![[20.0, 30.0]],
        law: Law::Linear { offset: 0.0, slope: 0.01 },
        weights: None,
    };
    let draft = draft.define().unwrap();
    let known = Known { drafts: vec![draft], ..known() };
    let (frames, noise, rig) = (measured(), noise(), ShippedRig::new(1.0));
    let not_shown = not_shown::out_of_sight(&[(draft, 0.0)]);
    let reason = "its change of these data is too small, or recalibration can reproduce it";
    assert_eq!(not_shown, [NotShown { effect: "range-switch", reason: reason.into() }]);
    let at = Parameters::declared(&known, 1);
    let open = Open { pairs: &[], not_shown: &not_shown, at: &at, draft: None, lacks_repeats: false };
    let plan = planner(&known, &frames, &noise, &rig).plan(open).unwrap();
    assert_eq!(plan.next, []);
    let [OpenQuestion { separates, best: Some(best) }] = &plan.open[..] else { panic!("{:?}", plan.open) };
    assert_eq!(separates, &["range-switch", "nothing"]);
    assert!(best.expected_z < Some(1e-6), "{best:?}");
}

#[test]
fn no_design_goes_deeper_or_loads_faster_than_the_data_did() {
    let (known, frames, noise, rig) = (known(), loaded(0.5), noise(), ShippedRig::new(0.5));
    let rehearsals = Rehearsals::of(planner(&known, &frames, &noise, &rig));
    let designs = rehearsals.designs(|_| true);
    assert_eq!(rehearsals.left_out(), []);
    for design in designs {
        let Design { of, rehearsal, .. } = design;
        let deepest_mm = rehearsal.frames.position_mm.iter().map(|at| -at[2]).fold(0.0, f64::max);
        assert!(deepest_mm < 0.6 * 1.06, "{}: {deepest_mm}", of.name);
        if of.name == "rates" {
            assert!(of.parameters.contains(&("speeds_mm_per_s", "[0.1,0.2,0.3,0.5]".into())));
        }
        let duration_s = rehearsal.duration_s;
        assert!(duration_s > 10.0 && duration_s < 900.0, "{}: {duration_s}", of.name);
    }
}

#[test]
fn a_rig_that_loads_faster_than_the_data_did_is_told_so() {
    let (known, frames, noise, rig) = (known(), loaded(0.5), noise(), ShippedRig::new(1.0));
    let rehearsals = Rehearsals::of(planner(&known, &frames, &noise, &rig));
    assert!(rehearsals.designs(|one| one.name == "hold").is_empty());
    let [short, _] = &rehearsals.left_out()[..] else { panic!("{:?}", rehearsals.left_out()) };
    assert!(short.reason.ends_with("mm/s, and these data only at 0.50 mm/s"), "{short:?}");
}

/// Three deep presses that are held, each with a rest: shorter than the part `hold`, and deeper.
const LONG_PRESSES: (&str, &str) = (
    "long-presses.star",
    r"
def run(rig):
    tare()
    for x_mm in (5.1, 9.1, 13.3):
        press(x_mm, 4.9, [0.6], dwell_s = 20.0)
        wait(20.0)
",
);

#[test]
fn a_script_of_the_lab_is_proposed_with_what_it_would_separate() {
    let known = known();
    let pair = twins(&known, DENT_OR_RELAXATION);
    let rig = ShippedRig::new(1.0).with_scripts(&[LONG_PRESSES]);
    let (frames, noise) = (measured(), noise());
    let planner = planner(&known, &frames, &noise, &rig);
    let rehearsals = Rehearsals::of(planner);
    let separates = ["imprint", "relaxation"].map(str::to_owned);
    let is_own = |one: &Candidate| one.is_own;
    let answer = rehearsals.answer(&separates, is_own, |design| planner.separation(design, &pair)).unwrap();
    let [own] = &answer.next[..] else { panic!("{answer:?}") };
    assert_eq!((&*own.experiment, &own.separates), ("long-presses.star", &separates));
    assert!(own.expected_z > Some(CLEAR_Z), "{own:?}");
    // Three dwells of 20 s and three rests.
    assert!((120.0..160.0).contains(&own.duration_s), "{own:?}");
}

#[test]
fn scripts_of_the_lab_that_cannot_be_made_are_left_out_with_the_reason() {
    let rig = ShippedRig::new(1.0).with_scripts(&[
        ("deep.star", "def run(rig):\n    press(8.1, 5.9, [0.9])\n"),
        ("deeper.star", "def run(rig):\n    press(8.1, 5.9, [0.7])\n"),
        ("failing.star", "def run(rig):\n    fail(\"no sample\")\n"),
        ("broken.star", "def run(rig:\n"),
        ("endless.star", "def run(rig):\n    for _ in range(10000):\n        wait(3600.0)\n"),
        ("empty.star", "def run(rig):\n    log(\"nothing\")\n"),
    ]);
    let known = known();
    let plan = planned(&[twins(&known, DENT_OR_RELAXATION)], &rig);
    assert_eq!(plan.next[0].experiment, "diagnose", "the others are proposed as ever");
    let reasons: Vec<(&str, &str)> =
        plan.left_out.iter().map(|one| (one.experiment.as_str(), one.reason.as_str())).collect();
    for (experiment, reason) in [
        ("deep.star", "deep.star:2"),
        (
            "deeper.star",
            "it presses 0.700 mm deep under the covering of 1.016 mm, and these data only 0.600 mm",
        ),
        ("failing.star", "no sample"),
        ("broken.star", "broken.star:2"),
        ("endless.star", "more than 60 min"),
    ] {
        assert!(
            reasons.iter().any(|(one, why)| *one == experiment && why.contains(reason)),
            "{experiment}: {reasons:?}"
        );
    }
    assert_eq!(reasons.len(), 5, "what presses nothing only separates nothing: {reasons:?}");
}

#[test]
fn each_experiment_has_a_seed_of_its_own_which_the_seed_of_the_discovery_decides() {
    let (known, frames, noise, rig) = (known(), measured(), noise(), ShippedRig::new(1.0));
    let planner = planner(&known, &frames, &noise, &rig);
    let seeds = |seed| {
        let rehearsals = Rehearsals::of(Planner { seed, ..planner });
        rehearsals
            .designs(|one| one.name == "rests" || one.name == "hold")
            .iter()
            .map(|one| one.seed)
            .collect()
    };
    let [one, same, other]: [Vec<u64>; 3] = [1, 1, 2].map(seeds);
    assert_eq!(one, same);
    let mut all = [one, other].concat();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), 8);
}
