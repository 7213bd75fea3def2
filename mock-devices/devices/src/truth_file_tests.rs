use tactus_model::{Covering, Moment, Trail};

use super::*;
use crate::test_bench::sim_rig;

const DIGITACTS: &str = include_str!("../../../config/models/digitacts.toml");

fn with(effects: &str) -> String {
    format!("{DIGITACTS}\n{effects}")
}

fn refused(text: &str) -> String {
    TruthFile::from_toml(text).and_then(|file| file.behind(&sim_rig(), 1)).unwrap_err().to_string()
}

#[test]
fn base_noise_and_effects_are_the_models_and_the_rest_is_the_rigs() {
    let text = with("[[effect]]\nname = \"surface-offset\"\nparameters = { offset_mm = 0.1 }");
    let rig = sim_rig();
    let (own, truth) =
        (Truth::of_rig(&rig, 1), TruthFile::from_toml(&text).unwrap().behind(&rig, 1).unwrap());
    assert_eq!(truth.model.response().quadratic_per_mm, [0.0; 48]);
    assert_eq!(truth.effects.len(), 1);
    let Truth { seed, faults, registration, surface_mm, stage, .. } = truth;
    let kept = (own.seed, own.faults, own.registration, own.surface_mm, own.stage);
    assert_eq!((seed, faults, registration, surface_mm, stage), kept);
}

#[test]
fn another_array_is_refused_with_both_named() {
    let other = DIGITACTS.replace("\"digitacts\"", "\"other\"");
    let said = refused(&other);
    assert!(said.starts_with("base.array: \"other\" (6 x 8 elements on "), "{said}");
    assert!(said.contains("not the array of rig \"sim\", \"digitacts\" (6 x 8 elements on "), "{said}");
    assert!(refused(&DIGITACTS.replace("rate_hz = 30.0", "rate_hz = 25.0")).contains(" 25 Hz, "));
}

#[test]
fn what_cannot_act_on_running_devices_is_refused_with_the_reason() {
    let early = "[[effect]]\nname = \"time-lag\"\nparameters = { lag_s = -0.1 }";
    assert_eq!(
        refused(&with(early)),
        "time-lag: lag_s = -0.1 cannot act on running devices, which do not know where the tip will be; remove the effect, or \
         make it 0 or more"
    );
    assert!(TruthFile::from_toml(&with(&early.replace("-0.1", "0.1"))).is_ok());
    let warm =
        "[[effect]]\nname = \"gain-drift\"\n[effect.parameters]\nrate_per_k = 0.01\nduration_s = 600.0\n";
    let gains = [1, 2, 3, 4, 5, 6].map(|knot| format!("gain_0{knot}_share = 0.0\n")).concat();
    let warm = with(&format!("{warm}{gains}"));
    assert!(
        refused(&warm).contains("rate_per_k = 0.01 cannot act on running devices, which know no temperature")
    );
    assert!(TruthFile::from_toml(&warm.replace("0.01\n", "0.0\n")).is_ok());
}

#[test]
fn a_file_that_is_no_model_names_its_fault() {
    assert!(
        refused(&DIGITACTS.replace("noise_rms_counts = 2.0", "noise_rms_counts = -2.0"))
            .contains("noise_rms_counts")
    );
    assert!(
        refused(&with("[[effect]]\nname = \"creep\"\nparameters = {}")).starts_with("effect[0]: no effect")
    );
}

const RELAXING: &str = include_str!("../../../config/hidden/relaxing-covering.toml");

#[test]
fn hidden_physics_comes_upon_the_rigs_own_simulation() {
    let rig = sim_rig();
    let (own, truth) =
        (Truth::of_rig(&rig, 1), TruthFile::from_toml(RELAXING).unwrap().behind(&rig, 1).unwrap());
    let [Dose { physics, strength, seed }] = truth.physics[..] else { panic!("one physics") };
    assert_eq!((physics.id, strength, seed), ("relaxation-prony", 1.0, 7));
    assert_eq!(truth.model.response(), own.model.response());
    let kept =
        |truth: &Truth| (truth.registration, truth.surface_mm, truth.noise_rms_counts, truth.faults.clone());
    assert_eq!(kept(&truth), kept(&own));
}

#[test]
fn physics_of_no_strength_reads_what_the_rigs_own_simulation_does() {
    let rig = sim_rig();
    let none = TruthFile::from_toml(&RELAXING.replace("strength = 1.0", "strength = 0.0")).unwrap();
    let [own, none] = [Truth::of_rig(&rig, 1), none.behind(&rig, 1).unwrap()]
        .map(|truth| pressed(&truth, rig.covering, &rig.registration.to_robot([5.0, 5.0])));
    assert!(own.iter().zip(&none).all(|(own, none)| (own - none).abs() < 1e-9), "{own:?} {none:?}");
    assert!(own.iter().any(|counts| *counts > 150.0), "pressed: {own:?}");
}

/// Counts while the tip stands half a millimetre deep, where two elements answer for their neighbours.
fn pressed(truth: &Truth, covering: Covering, [x_mm, y_mm]: &[f64; 2]) -> Vec<f64> {
    let mut sensor_model = truth.sensor_model(covering).unwrap();
    sensor_model.step(Moment::at(0.0), &Trail::new(0.0, [*x_mm, *y_mm, -0.5])).to_vec()
}

#[test]
fn a_model_with_knots_is_what_the_devices_hide() {
    let rig = sim_rig();
    let knots = with(
        "[[effect]]\nname = \"hardening\"\nparameters = { own_share = 0 }\nknots = { at_mm = [0.2], growth = [0.5] }",
    );
    let [plain, hard] = [DIGITACTS, &knots].map(|text| {
        let truth = TruthFile::from_toml(text).unwrap().behind(&rig, 1).unwrap();
        pressed(&truth, rig.covering, &rig.registration.to_robot([5.0, 5.0]))
    });
    // Deeper than the only knot all elements rise by half as much again.
    for (hard, plain) in hard.iter().zip(&plain) {
        assert!((hard - 100.0 - 1.5 * (plain - 100.0)).abs() < 1e-9, "{hard} {plain}");
    }
    assert!(plain.iter().any(|counts| *counts > 150.0), "pressed: {plain:?}");
}

#[test]
fn wrong_physics_is_refused_with_the_entry_and_what_would_be_right() {
    let wrong = |from: &str, to: &str| refused(&RELAXING.replace(from, to));
    assert_eq!(
        wrong("relaxation-prony", "magic"),
        "physics[0].id: no physics \"magic\"; `tactus-mock hidden list` names all of them"
    );
    assert_eq!(
        wrong("strength = 1.0", "strength = -1.0"),
        "physics[0].strength: must be from 0 to 8, not -1"
    );
    assert!(wrong("seed = 7", "sead = 7").contains("sead"));
}
