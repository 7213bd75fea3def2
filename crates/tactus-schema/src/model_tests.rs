use super::*;

const DIGITACTS: &str = include_str!("../../../config/models/digitacts.toml");

const GROWN: &str = r#"
[[effect]]
name = "relaxation"
parameters = { relaxed_share = 0.12, time_constant_s = 8.1, spread_ratio = 1, after_release = 0, recovery_ratio = 1 }
standard_errors = { relaxed_share = 0.004 }
evidence = { data = "4f1c", heldout_rms_before_counts = 9.3, heldout_rms_after_counts = 2.2 }

[[effect]]
name = "miswired"
parameters = { element = 18, answers_for = 19, own_share = 0, other_share = 1 }
"#;

fn grown() -> String {
    format!("{DIGITACTS}{GROWN}")
}

fn refused(from: &str, to: &str) -> String {
    let text = grown();
    assert!(text.contains(from), "there is no {from:?}");
    Model::from_toml(&text.replacen(from, to, 1)).unwrap_err().to_string()
}

#[test]
fn the_shipped_model_is_the_papers() {
    let model = Model::from_toml(DIGITACTS).unwrap();
    assert_eq!(model.base.array, Array::digitacts());
    assert_eq!(model.base.psf, Psf::PAPER);
    assert_eq!(model.base.response.sensitivity_counts_per_mm, vec![1000.0; 48]);
    assert!(model.effects.is_empty());
}

#[test]
fn effects_come_with_their_errors_and_evidence() {
    let model = Model::from_toml(&grown()).unwrap();
    let [relaxation, miswired] = &model.effects[..] else { panic!("two effects") };
    assert_eq!(relaxation.effect.name(), "relaxation");
    assert_eq!(relaxation.effect.value("time_constant_s"), Some(8.1));
    assert_eq!(relaxation.standard_errors, BTreeMap::from([("relaxed_share".into(), 0.004)]));
    assert_eq!(relaxation.evidence.as_ref().map(|evidence| evidence.data.as_str()), Some("4f1c"));
    assert_eq!(miswired.effect.value("answers_for"), Some(19.0));
    let cylinder = Indenter::Cylinder { diameter_mm: 1.0 };
    let registration = Registration { origin_mm: [0.0, 0.0], rotation_deg: 0.0 };
    let simulator = model.simulator(registration, 0.0, Covering { thickness_mm: 1.016 }, cylinder).unwrap();
    assert_eq!(simulator.effects.len(), 2);
}

#[test]
fn what_is_written_reads_back_to_the_bit() {
    let mut model = Model::from_toml(&grown()).unwrap();
    // What has no sign is written as ever.
    assert!(!model.to_toml().unwrap().contains("least_counts"));
    model.base.array = model.base.array.with_least_counts(-0.1).unwrap();
    model.base.response.sensitivity_counts_per_mm = (0..48).map(|k| 1e3 / f64::from(k + 3)).collect();
    model.base.psf.sigma_per_mm = 0.1 + 0.2;
    model.base.psf_se = [Some(1e-17), None];
    model.base.baseline_counts_se = Some(vec![0.3; 48]);
    model.base.quadratic_per_mm_se = Some((0..48).map(|k| f64::from(k).sqrt()).collect());
    let corners = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.1], [1.0, 1.0 / 3.0, 0.0]];
    let mesh = tactus_model::Mesh::new(&corners, &[[0, 1, 2]]).unwrap();
    let shapes = [
        model.base.response.reference_indenter.clone(),
        Indenter::Sphere { diameter_mm: 4.1 },
        Indenter::Cone { diameter_mm: 4.1, apex_deg: 60.0 },
        Indenter::Box { size_mm: [1.0, 2.0] },
        Indenter::Mesh(std::sync::Arc::new(mesh)),
    ];
    for shape in shapes {
        model.base.response.reference_indenter = shape;
        let text = model.to_toml().unwrap();
        assert_eq!(Model::from_toml(&text).unwrap(), model, "{text}");
    }
}

const FREE: &str = r#"
[[effect]]
name = "hardening"
parameters = { own_share = 0.25 }
knots = { at_mm = [0.1, 0.30000000000000004, 0.6], growth = [0.0, 0.1, 0.3333333333333333] }

[[effect]]
name = "saturation"
knots = { at_mm = [0.4], lost_share = [1e-17] }
"#;

#[test]
fn an_effect_may_have_knots_in_place_of_its_formula() {
    let model = Model::from_toml(&format!("{DIGITACTS}{FREE}")).unwrap();
    let [hardening, saturation] = &model.effects[..] else { panic!("two effects") };
    let knots = hardening.effect.knots().unwrap();
    assert_eq!(knots.at, [0.1, 0.1 + 0.2, 0.6]);
    assert_eq!(knots.values, [0.0, 0.1, 1.0 / 3.0]);
    assert_eq!((hardening.effect.value("own_share"), hardening.effect.value("exponent")), (Some(0.25), None));
    assert_eq!(saturation.effect.parameters().collect::<Vec<_>>(), [("counts_share", 0.0)]);
    let text = model.to_toml().unwrap();
    assert_eq!(Model::from_toml(&text).unwrap(), model, "to the bit: {text}");
}

#[test]
fn knots_that_break_the_rules_of_the_effects_curve_are_refused() {
    let refused = |from: &str, to: &str| {
        let text = format!("{DIGITACTS}{FREE}");
        assert!(text.contains(from), "there is no {from:?}");
        Model::from_toml(&text.replacen(from, to, 1)).unwrap_err().to_string()
    };
    for (from, to, error) in [
        (
            "at_mm = [0.1,",
            "at_s = [0.1,",
            "effect[0].knots: those of hardening have at_mm and growth and nothing else",
        ),
        (
            "lost_share",
            "growth",
            "effect[1].knots: those of saturation have at_mm and lost_share and nothing else",
        ),
        (
            "own_share = 0.25",
            "own_share = 0.25, exponent = 2",
            "effect[0]: hardening: exponent is replaced by the knots",
        ),
        ("own_share = 0.25", "", "effect[0]: hardening: own_share is missing"),
        (
            "growth = [0.0, 0.1",
            "growth = [0.6, 0.1",
            "effect[0]: hardening: knots.growth[1] must be at least",
        ),
        ("[0.0, 0.1", "[-0.1, 0.1", "effect[0]: hardening: knots.growth[0] must be from 0 to 20, not -0.1"),
        ("at_mm = [0.1", "at_mm = [0.7", "effect[0]: hardening: knots.at_mm[1] must be finite and above 0.7"),
        ("at_mm = [0.4]", "at_mm = [inf]", "effect[1]: saturation: knots.at_mm[0] must be finite"),
        ("[1e-17]", "[]", "effect[1]: saturation: knots must be 1 to 64"),
        ("\"saturation\"", "\"backlash\"", "effect[1]: backlash: has no knots"),
    ] {
        let said = refused(from, to);
        assert!(said.starts_with(error), "{said:?} does not start with {error:?}");
    }
}

#[test]
fn a_misspelt_key_is_refused_with_its_line() {
    for key in ["noise_rms_counts", "element_mm", "sigma_per_mm", "shape", "evidence", "data"] {
        let error = refused(&format!("{key} ="), &format!("{key}s ="));
        assert!(error.contains(&format!("{key}s")) && error.contains("line"), "{key}: {error}");
    }
}

#[test]
fn contradictions_are_refused_with_their_field() {
    for (from, to, field) in [
        ("tactus.model/1", "tactus.model/2", "schema: this program reads"),
        ("rows = 6", "rows = 7", "base.array.rows: says 7, but 6"),
        (
            "baseline_counts = 100.0",
            "baseline_counts = [1.0]",
            "base.baseline_counts: 1 values for 48 elements",
        ),
        ("baseline_counts = 100.0", "baseline_counts = nan", "base.baseline_counts[0]: "),
        (
            "baseline_counts = 100.0",
            "baseline_counts = 100.0\nbaseline_counts_se = -1.0",
            "base.baseline_counts_se[0]: not negative",
        ),
        (
            "diameter_mm = 1.0",
            "size_mm = [1.0, 1.0]",
            "base.sensitivity_reference.indenter.shape: this shape has a diameter_mm and nothing else",
        ),
        ("noise_rms_counts = 2.0", "noise_rms_counts = -2.0", "base.noise_rms_counts: not negative"),
        ("sigma_intercept_mm = 2.22", "sigma_intercept_mm = 0.0", "base.psf.sigma_intercept_mm: positive"),
        (
            "diameter_mm = 1.0",
            "diameter_mm = 0.0",
            "base.sensitivity_reference.indenter.diameter_mm: positive",
        ),
        ("sigma_per_mm = 0.497", "sigma_per_mm = 1e11", "base: sigma must be"),
        ("element_mm = [1.8, 1.8]", "element_mm = [2.8, 1.8]", "base.array: col_centres_mm[1]"),
        ("\"relaxation\"", "\"creep\"", "effect[0]: no effect \"creep\"; there is: "),
        ("time_constant_s", "time_constant", "effect[0]: relaxation: no parameter \"time_constant\""),
        (", time_constant_s = 8.1", "", "effect[0]: relaxation: time_constant_s is missing"),
        ("element = 18", "element = 48", "effect[1]: miswired: element must be one of the elements 0 to 47"),
        (
            "errors = { relaxed_share",
            "errors = { share",
            "effect[0].standard_errors.share: relaxation has no",
        ),
        (
            "before_counts = 9.3",
            "before_counts = -1",
            "effect[0].evidence.heldout_rms_before_counts: not neg",
        ),
    ] {
        let error = refused(from, to);
        assert!(error.starts_with(field), "{field}: {error}");
    }
}

#[test]
fn a_rig_gives_the_model_of_its_description() {
    let rig = Rig::from_toml(include_str!("../../../config/rigs/sim.toml")).unwrap();
    let model = Model::of_rig(&rig).unwrap();
    let shipped = Model::from_toml(DIGITACTS).unwrap();
    // The simulated rig is the paper's sensor, and states no noise.
    assert_eq!(model, Model { base: BaseModel { noise_rms_counts: 0.0, ..shipped.base }, ..model.clone() });
}

#[test]
fn on_another_array_the_elements_are_alike_and_the_spread_is_the_same() {
    let mut model = Model::from_toml(&grown()).unwrap();
    model.base.response.sensitivity_counts_per_mm = (0..48).map(|k| 900.0 + f64::from(k)).collect();
    model.base.sensitivity_counts_per_mm_se = Some(vec![1.0; 48]);
    let on = model.on(Array::fingertip());
    assert_eq!(on.base.response.sensitivity_counts_per_mm, vec![923.5; 280]);
    assert_eq!((on.base.psf, on.base.noise_rms_counts), (model.base.psf, 2.0));
    assert_eq!(on.base.sensitivity_counts_per_mm_se, None);
    assert_eq!(on.effects, model.effects[..1], "elements of the other array mean nothing here");
    // A reference press reads what it reads on the array that was characterised.
    let forward = on.forward().unwrap();
    let position_mm = forward.array().centre_mm(130).unwrap();
    let indenter = Indenter::Cylinder { diameter_mm: 1.0 };
    let contact = tactus_model::Contact { indenter, position_mm, rotation_deg: 0.0, depth_mm: 0.5 };
    let mut counts = vec![0.0; 280];
    forward.image(&contact, Covering { thickness_mm: 1.016 }, &mut counts);
    assert!((counts[130] - (100.0 + 923.5 * 0.5)).abs() < 1e-9);
}

const TABLED: &str = r#"
[[effect]]
name = "indenter-tilt"
parameters = { tilt_y_deg = 0.0, touched_share = 0.5 }
tables.tilt_x_deg = { by = "x_mm", at = [0.0, 0.30000000000000004], values = [0.0, 3.3333333333333335] }
"#;

#[test]
fn a_parameter_may_have_a_table_in_place_of_its_value() {
    let model = Model::from_toml(&format!("{DIGITACTS}{TABLED}")).unwrap();
    let (name, table) = model.effects[0].effect.tables().next().unwrap();
    assert_eq!((name, table.value(0.1 + 0.2), table.value(9.0)), ("tilt_x_deg", 10.0 / 3.0, 10.0 / 3.0));
    assert_eq!(model.effects[0].effect.value("tilt_x_deg"), None);
    let text = model.to_toml().unwrap();
    assert_eq!(Model::from_toml(&text).unwrap(), model, "to the bit: {text}");
    for (from, to, error) in [
        ("x_mm", "force_n", "effect[0].tables.tilt_x_deg.by: must be one of depth_mm, x_mm, y_mm"),
        ("tables.tilt_x_deg", "tables.lean", "effect[0]: indenter-tilt: no parameter \"lean\""),
        (
            "tilt_y_deg = 0.0",
            "tilt_y_deg = 0.0, tilt_x_deg = 1",
            "effect[0]: indenter-tilt: tilt_x_deg is replaced by its table",
        ),
        (
            "[0.0, 3.3333333333333335]",
            "[0.0, 11]",
            "effect[0]: indenter-tilt: the table of tilt_x_deg must have values from -10 to 10",
        ),
        (
            "[0.0, 3.3333333333333335]",
            "[0.0]",
            "effect[0]: indenter-tilt: the table of tilt_x_deg must have 1 to 64 places",
        ),
    ] {
        assert!(TABLED.contains(from), "there is no {from:?}");
        let text = format!("{DIGITACTS}{}", TABLED.replacen(from, to, 1));
        let refused = Model::from_toml(&text).unwrap_err().to_string();
        assert!(refused.contains(error), "{refused}");
    }
}
