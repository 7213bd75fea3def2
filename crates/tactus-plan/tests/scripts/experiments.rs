//! Shipped experiments, run on a sensor that is a formula.

use crate::fake::FakeRig;
use serde_json::Value;
use tactus_plan::{Arguments, Call, Outcome, Position, Script, ScriptLimits, Step, execute};

const ELEMENT_CENTRES: &str = include_str!("../../../../experiments/element-centres.star");
const GRID_SWEEP: &str = include_str!("../../../../experiments/grid-sweep.star");
const CORNERS: &str = include_str!("../../../../experiments/corners.star");
const DIAGNOSE: &str = include_str!("../../../../experiments/diagnose.star");

fn run(name: &str, source: &str, given: &[&str], seed: u64, rig: &mut FakeRig) -> Outcome {
    let script = Script::parse(name, source).unwrap();
    let mut arguments = Arguments::default();
    for assignment in given {
        arguments.set(assignment).unwrap();
    }
    execute(&script, &arguments, &rig.view(), seed, &ScriptLimits::default(), rig).unwrap_or_else(|error| {
        panic!("{error}\n{}\n{}", error.call_stack(), rig.logged());
    })
}

fn places(rig: &FakeRig) -> Vec<Position> {
    rig.presses().iter().map(|press| press.at).collect()
}

#[test]
fn element_centres_presses_every_element_once_through_five_depths() {
    let mut rig = FakeRig::new();
    let outcome = run("element-centres", ELEMENT_CENTRES, &[], 7, &mut rig);
    assert_eq!((rig.presses().len(), rig.dwells()), (48, 240));
    assert!(matches!(rig.calls[0].step, Step::Tare { .. }));
    for press in rig.presses() {
        assert_eq!(press.depths_mm, [0.2, 0.3, 0.4, 0.5, 0.6]);
        assert!((press.dwell_s - 0.25).abs() < 1e-12);
    }
    let mut indices: Vec<_> = places(&rig).iter().map(|at| index_at(&rig, *at)).collect();
    indices.sort_unstable();
    assert_eq!(indices, (0..48).collect::<Vec<_>>());
    assert_eq!(outcome.steps, 50);
}

#[test]
fn the_seed_alone_gives_the_order() {
    let places_with = |seed, given: &[&str]| {
        let mut rig = FakeRig::new();
        run("element-centres", ELEMENT_CENTRES, given, seed, &mut rig);
        places(&rig)
    };
    assert_eq!(places_with(7, &[]), places_with(7, &[]));
    assert_ne!(places_with(7, &[]), places_with(8, &[]));
    let raster = places_with(7, &["order=raster"]);
    assert_eq!(raster, places_with(8, &["order=raster"]));
    assert_eq!(raster[0], Position { x_mm: 0.9, y_mm: 0.9 });
    assert_eq!(raster[47], Position { x_mm: 15.3, y_mm: 10.9 });
}

#[test]
fn the_grid_sweep_is_the_papers_2700_presses() {
    let mut rig = FakeRig::new();
    run("grid-sweep", GRID_SWEEP, &[], 3, &mut rig);
    assert_eq!((rig.presses().len(), rig.dwells()), (2700, 2700));
    let coverings: Vec<_> = rig
        .calls
        .iter()
        .filter_map(|call| match call.step {
            Step::Covering { thickness_mm } => Some(thickness_mm),
            _ => None,
        })
        .collect();
    // The thinnest is in place.
    assert_eq!(coverings, [2.54, 3.556, 5.08]);
    let centre = rig.view().elements[19];
    for press in rig.presses() {
        assert!(
            (press.at.x_mm - centre.x_mm).abs() < 0.7 + 1e-9
                && (press.at.y_mm - centre.y_mm).abs() < 0.7 + 1e-9
        );
    }
    let deepest = rig.presses().iter().map(|press| press.depths_mm[0]).fold(0.0, f64::max);
    assert!((deepest - 0.65 * 5.08).abs() < 1e-9, "{deepest}");
}

#[test]
fn a_grid_under_one_covering_is_a_quarter_of_it() {
    let mut rig = FakeRig::new();
    run("grid-sweep", GRID_SWEEP, &["coverings_mm=[1.016]", "order=raster"], 3, &mut rig);
    assert_eq!(rig.presses().len(), 675);
    let steps_mm = rig.presses()[3].at.x_mm - rig.presses()[0].at.x_mm;
    assert!((steps_mm - 0.1).abs() < 1e-9, "{steps_mm}");
    assert!(!rig.calls.iter().any(|call| matches!(call.step, Step::Covering { .. })));
}

#[test]
fn corners_finds_a_planted_place_angle_and_surface() {
    let mut rig = FakeRig::new();
    rig.origin_mm = [20.31, 14.78];
    rig.rotation_deg = 0.9;
    rig.surface_mm = 0.031;
    let result = run("corners", CORNERS, &[], 1, &mut rig).result;
    // Noise of 2 counts on 200 over 15 frames, through a slope of 0.57 per mm: some 0.005 mm a point.
    assert!((number(&result, "/origin_mm/0") - 20.31).abs() < 0.03, "{result}");
    assert!((number(&result, "/origin_mm/1") - 14.78).abs() < 0.03, "{result}");
    assert!((number(&result, "/rotation_deg") - 0.9).abs() < 0.1, "{result}");
    assert!((number(&result, "/scale") - 1.0).abs() < 0.005, "{result}");
    assert!((number(&result, "/surface/depth_mm") - 0.031).abs() < 0.003, "{result}");
    assert!(
        number(&result, "/origin_error_mm") > 0.0 && number(&result, "/origin_error_mm") < 0.03,
        "{result}"
    );
    assert!(rig.logged().contains("registration: origin_mm = [20.3"), "{}", rig.logged());
    assert!(rig.presses().len() < 60, "{}", rig.presses().len());
}

#[test]
fn without_noise_corners_is_exact() {
    let mut rig = FakeRig::new();
    rig.noise_counts = 0.0;
    rig.origin_mm = [19.8, 15.2];
    let result = run("corners", CORNERS, &["tolerance_mm=0.001"], 1, &mut rig).result;
    assert!((number(&result, "/origin_mm/0") - 19.8).abs() < 1e-4, "{result}");
    assert!((number(&result, "/origin_mm/1") - 15.2).abs() < 1e-4, "{result}");
    assert!(number(&result, "/surface/depth_mm").abs() < 1e-9, "{result}");
}

#[test]
fn corners_passes_over_elements_that_answer_for_others() {
    let mut rig = FakeRig::new();
    // Neighbours of the elements next to either corner.
    rig.miswired = vec![(8, 9), (46, 45)];
    rig.origin_mm = [20.1, 15.1];
    let result = run("corners", CORNERS, &[], 1, &mut rig).result;
    let element = |pointer| result.pointer(pointer).and_then(Value::as_u64);
    assert_ne!((element("/points/0/element"), element("/points/1/element")), (Some(9), Some(38)));
    assert!((number(&result, "/origin_mm/0") - 20.1).abs() < 0.03, "{result}");
    assert!(rig.logged().contains("does not answer to its own place"), "{}", rig.logged());
}

#[test]
fn diagnose_takes_a_quarter_of_an_hour_and_does_every_part() {
    let mut rig = FakeRig::new();
    let result = run("diagnose", DIAGNOSE, &[], 5, &mut rig).result;
    let minutes = rig.elapsed_s / 60.0;
    assert!((15.0..20.0).contains(&minutes), "{minutes} minutes");
    for part in ["drift", "repeats", "ladder", "rates", "approach", "tilt", "hold"] {
        assert!(!result[part].is_null(), "{part}: {result}");
    }
    assert_eq!(rig.presses().iter().filter(|press| press.approach_from_mm.is_some()).count(), 20);
    assert_eq!(rig.presses().iter().filter(|press| press.speed_mm_per_s.is_some()).count(), 18);
    let held = rig.presses().iter().map(|press| press.depths_mm.len()).max();
    assert_eq!(held, Some(50));
}

#[test]
fn a_scaled_diagnosis_is_short() {
    let mut rig = FakeRig::new();
    rig.miswired = vec![(19, 18)];
    run("diagnose", DIAGNOSE, &["scale=0.05"], 5, &mut rig);
    assert!(rig.elapsed_s < 240.0, "{}", rig.elapsed_s);
    assert!(rig.logged().contains("element 19 does not answer"), "{}", rig.logged());
}

#[test]
fn diagnose_makes_only_the_parts_that_are_asked_for() {
    let mut rig = FakeRig::new();
    let result = run("diagnose", DIAGNOSE, &["parts=rests, hold", "scale=0.1"], 5, &mut rig).result;
    let made: Vec<&str> = result.as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(made, ["hold", "rests"]);
    for part in ["wide", "depths", "rests", "reversals"] {
        let mut rig = FakeRig::new();
        let result = run("diagnose", DIAGNOSE, &[&format!("parts={part}")], 5, &mut rig).result;
        assert!(!result[part].is_null(), "{part}: {result}");
        let minutes = rig.elapsed_s / 60.0;
        assert!((1.0..6.0).contains(&minutes), "{part}: {minutes} minutes");
        let extent_mm = rig.view().extent_mm;
        for at in places(&rig) {
            let inside = |mm: f64, [least, most]: [f64; 2]| (least..=most).contains(&mm);
            assert!(inside(at.x_mm, extent_mm[0]) && inside(at.y_mm, extent_mm[1]), "{part}: {at:?}");
        }
    }
}

#[test]
fn a_part_that_is_not_is_refused_with_those_that_are() {
    let script = Script::parse("diagnose", DIAGNOSE).unwrap();
    let mut arguments = Arguments::default();
    arguments.set("parts=hold,rest").unwrap();
    let mut rig = FakeRig::new();
    let refused =
        execute(&script, &arguments, &rig.view(), 1, &ScriptLimits::default(), &mut rig).unwrap_err();
    assert!(
        refused.to_string().contains("parts: there is no rest - there is: [\"drift\", \"repeats\","),
        "{refused}"
    );
    assert!(rig.calls.is_empty());
}

#[test]
fn every_experiment_documents_itself_and_its_parameters() {
    for (name, source) in [
        ("element-centres", ELEMENT_CENTRES),
        ("grid-sweep", GRID_SWEEP),
        ("corners", CORNERS),
        ("diagnose", DIAGNOSE),
    ] {
        let script = Script::parse(name, source).unwrap();
        assert!(script.summary().len() > 20 && script.doc().lines().count() > 5, "{name}: {}", script.doc());
        let parameters = script.parameters(&FakeRig::new().view()).unwrap();
        assert!(parameters.len() >= 3, "{name}");
        for parameter in parameters {
            assert!(!parameter.doc.is_empty(), "{name}: {}", parameter.name);
            assert_eq!(
                parameter.name.ends_with("_mm"),
                parameter.unit.as_deref() == Some("mm"),
                "{}",
                parameter.name
            );
        }
    }
}

#[test]
fn two_executions_ask_for_the_same_steps() {
    let calls = |seed| -> Vec<Call> {
        let mut rig = FakeRig::new();
        run("diagnose", DIAGNOSE, &["scale=0.05"], seed, &mut rig);
        rig.calls
    };
    assert_eq!(calls(11), calls(11));
}

fn index_at(rig: &FakeRig, at: Position) -> usize {
    let view = rig.view();
    let element = view.elements.iter().find(|e| (e.x_mm - at.x_mm).hypot(e.y_mm - at.y_mm) < 1e-9);
    element.unwrap().index
}

fn number(result: &Value, pointer: &str) -> f64 {
    result.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {pointer} in {result}"))
}
