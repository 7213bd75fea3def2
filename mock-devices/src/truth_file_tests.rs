use super::*;
use crate::bench::sim_rig;

const DIGITACTS: &str = include_str!("../../config/models/digitacts.toml");

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
