use tactus_model::Registration;
use tactus_schema::table::{Phase, RowView};

use super::*;
use crate::fixtures;

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

#[test]
fn the_speeds_are_the_scripts_own() {
    let script = include_str!("../../../experiments/diagnose.star");
    assert!(script.contains(&format!("default = {:?},", design::SPEEDS_MM_PER_S)));
}

/// Clearly more than [`WORTH_Z`].
const CLEAR_Z: f64 = 8.0;

fn noise() -> Noise {
    Noise { rms_counts: 2.0, by_element_counts: vec![2.0; 48], correlation: vec![1.0], rounding_share: 0.0 }
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
    let (frames, noise) = (measured(), noise());
    let [right, wrong] = [right, wrong].map(|(name, values)| explanation(known, name, values));
    let designs = DesignSpace::of(known, &frames).designs();
    let frames = &designs.iter().find(|design| design.name == "element-centres").unwrap().frames;
    let mut bins = Bins::of(frames, true).unwrap();
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
    let (known, frames, noise) = (known(), measured(), noise());
    let planner = Planner { known: &known, frames: &frames, noise: &noise };
    let pair = twins(&known, of);
    let designs = DesignSpace::of(&known, &frames).designs();
    names.map(|name| {
        let design = designs.iter().find(|design| design.name == name).unwrap();
        planner.separation(design, &pair).unwrap().z
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

#[test]
fn the_greatest_share_comes_first_and_experiments_with_less_are_shorter() {
    let (known, frames, noise) = (known(), measured(), noise());
    let planner = Planner { known: &known, frames: &frames, noise: &noise };
    let pair = twins(
        &known,
        [
            ("imprint", &[("set_share", 0.05), ("recovery_s", 5.0)]),
            ("relaxation", &[("relaxed_share", 0.05), ("time_constant_s", 5.0)]),
        ],
    );
    let share = |proposal: &NextExperiment| {
        let designs = DesignSpace::of(&known, &frames).designs();
        let design = designs.iter().find(|design| {
            (design.experiment, &design.parameters) == (proposal.experiment, &proposal.parameters)
        });
        planner.separation(design.unwrap(), &pair).unwrap().share
    };
    let proposals = planner.propose(std::slice::from_ref(&pair)).unwrap();
    assert!(!proposals.is_empty() && proposals.len() <= PROPOSALS_MAX);
    assert_eq!(proposals[0].separates, ["imprint", "relaxation"]);
    let shares: Vec<f64> = proposals.iter().map(share).collect();
    assert!(shares.iter().rev().is_sorted(), "{shares:?}");
    assert!(proposals.windows(2).all(|pair| pair[1].duration_s < pair[0].duration_s), "{proposals:?}");
    let shown_by = ["imprint", "relaxation"].map(|name| Definition::find(name).unwrap().shown_by).concat();
    let of_all = DesignSpace::of(&known, &frames).designs();
    let greatest = of_all
        .iter()
        .filter(|design| shown_by.contains(&design.name))
        .map(|design| planner.separation(design, &pair).unwrap().share)
        .fold(0.0, f64::max);
    assert!((shares[0] - greatest).abs() < 1e-12, "{shares:?} of {greatest}");
}

#[test]
fn nothing_is_proposed_between_an_explanation_and_itself() {
    let (known, frames, noise) = (known(), measured(), noise());
    let planner = Planner { known: &known, frames: &frames, noise: &noise };
    let one = explanation(&known, "relaxation", &[("relaxed_share", 0.1)]);
    let pair = Pair { of: [one.clone(), one], without: Parameters::declared(&known, 1), gain: 100.0 };
    assert_eq!(planner.propose(&[pair]).unwrap(), []);
}

#[test]
fn an_effect_that_the_data_cannot_show_gets_an_experiment_of_its_own() {
    let (known, frames, noise) = (known(), measured(), noise());
    let planner = Planner { known: &known, frames: &frames, noise: &noise };
    let not_shown = [NotShown { effect: "relaxation", reason: "no depth was held".into() }];
    let proposals = planner.show(&not_shown, &Parameters::declared(&known, 1)).unwrap();
    let [one] = &proposals[..] else { panic!("one proposal: {proposals:?}") };
    assert_eq!(
        (one.experiment, one.separates.clone()),
        ("diagnose", ["relaxation".into(), "nothing".into()])
    );
}

#[test]
fn no_design_goes_deeper_or_loads_faster_than_the_data_did() {
    let (known, frames) = (known(), loaded(0.5));
    for design in DesignSpace::of(&known, &frames).designs() {
        let deepest_mm = design.frames.position_mm.iter().map(|at| -at[2]).fold(0.0, f64::max);
        assert!(deepest_mm < 0.6 * 1.06, "{}: {deepest_mm}", design.name);
        if design.name == "rates" {
            assert!(design.parameters.contains(&("speeds_mm_per_s", "[0.1,0.2,0.3,0.5]".into())));
        }
        assert!(
            design.duration_s > 10.0 && design.duration_s < 900.0,
            "{}: {}",
            design.name,
            design.duration_s
        );
    }
}
