use super::*;

const SIM: &str = include_str!("../../../config/rigs/sim.toml");

fn refused(from: &str, to: &str) -> String {
    assert!(SIM.contains(from), "the shipped rig has no {from:?}");
    Rig::from_toml(&SIM.replace(from, to)).unwrap_err().to_string()
}

#[test]
fn the_shipped_rig_is_the_papers() {
    let rig = Rig::from_toml(SIM).unwrap();
    assert_eq!(rig.array, Array::digitacts());
    assert!(
        (rig.psf.sigma_mm(rig.covering) / tactus_model::DIGITACTS_PITCH_MM - 1.36).abs() < 0.005,
        "Sec. 4 says 1.36"
    );
    assert!((rig.depth_max_mm().unwrap() - 0.7112).abs() < 1e-12);
    assert_eq!(rig.mounted(), Some(Indenter::Cylinder { diameter_mm: 1.0 }));
}

#[test]
fn a_misspelt_key_is_refused_with_its_line() {
    let error = refused("depth_share_max", "depth_share_maximum");
    assert!(error.contains("depth_share_maximum") && error.contains("line"), "{error}");
}

#[test]
fn contradictions_are_refused_with_their_field() {
    for (from, to, field) in [
        ("rows = 6", "rows = 7", "array.rows"),
        ("simulated = true\nindenter = \"cyl1\"", "simulated = true\nindenter = \"cyl9\"", "indenter"),
        ("depth_share_max = 0.70", "depth_share_max = 1.4", "envelope.depth_share_max"),
        ("travel_speed_mm_per_s = 20.0", "travel_speed_mm_per_s = 90.0", "motion.travel_speed_mm_per_s"),
        ("thickness_mm = 1.016", "thickness_mm = -1.0", "covering.thickness_mm"),
        ("baseline_counts = 100.0", "baseline_counts = [1.0, 2.0]", "baseline_counts"),
        ("name = \"sim\"", "name = \"a/b\"", "name"),
        ("{ element = 18,", "{ element = 48,", "simulation.miswired"),
        ("gain_spread = 0.08", "gain_spread = 1e300", "simulation.gain_spread"),
        ("sigma_per_mm = 0.497", "sigma_per_mm = 1e11", "sensitivity_reference"),
    ] {
        let error = refused(from, to);
        assert!(error.starts_with(field), "{field}: {error}");
    }
}

#[test]
fn a_simulated_element_has_one_fault_at_most() {
    let with = |faults: &str| {
        Rig::from_toml(&SIM.replace("[simulation.stage]", &format!("{faults}\n[simulation.stage]")))
    };
    let rig = with(
        "dead = [3]\nstuck = [{ element = 5, counts = 812 }]\nnoisy = [{ element = 7, noise_rms_counts = 25 }]",
    );
    let want = BTreeMap::from([
        (3, ElementFault::Dead),
        (5, ElementFault::Stuck { counts: 812 }),
        (7, ElementFault::Noisy { noise_rms_counts: 25.0 }),
        (18, ElementFault::Miswired { answers_for: 19 }),
        (22, ElementFault::Miswired { answers_for: 23 }),
    ]);
    assert_eq!(rig.unwrap().simulation.unwrap().faults, want);

    for (faults, refusal) in [
        ("dead = [48]", "simulation.dead: elements are 0 to 47"),
        ("dead = [3, 3]", "simulation.dead: element 3 has a fault already"),
        ("dead = [18]", "simulation.dead: element 18 has a fault already"),
        ("stuck = [{ element = 48, counts = 0 }]", "simulation.stuck: elements are 0 to 47"),
        ("stuck = [{ element = 5, counts = 4096 }]", "simulation.stuck: counts are 0 to 4095, not 4096"),
        ("noisy = [{ element = 7, noise_rms_counts = -1.0 }]", "simulation.noisy"),
        ("noisy = [{ element = 22, noise_rms_counts = 1.0 }]", "simulation.noisy: element 22 has a fault"),
    ] {
        let error = with(faults).unwrap_err().to_string();
        assert!(error.starts_with(refusal), "{faults}: {error}");
    }
    let error = refused("answers_for = 19", "answers_for = 18");
    assert!(error.starts_with("simulation.miswired: element 18 answers for itself"), "{error}");
}

#[test]
fn the_json_that_goes_with_data_reads_back_without_links_limits_and_secrets() {
    let rig = Rig::from_toml(SIM).unwrap();
    let back = Rig::from_json(&rig.to_json()).unwrap();
    assert_eq!(back, Rig { service: None, simulation: None, ..rig });
}

#[test]
fn a_shape_takes_its_own_size_only() {
    let error = refused("diameter_mm = 1.0", "size_mm = [1.0, 2.0]");
    assert!(error.starts_with("indenters.cyl1.shape"), "{error}");
}

#[test]
fn cones_and_meshes_stand_in_the_file_and_go_with_data() {
    let cone = "shape = \"cone\"\ndiameter_mm = 4.0\napex_deg = 60.0";
    let wedge = "shape = \"mesh\"\nvertices_mm = [[0.0, 0.0, 0.0], [3, 0, 0.1], [1.0, 1.0, 0.25]]\n\
                 triangles = [[0, 1, 2]]";
    let toml = format!("{SIM}\n[indenters.cone60]\n{cone}\n[indenters.wedge]\n{wedge}\n");
    let rig = Rig::from_toml(&toml).unwrap();
    assert_eq!(rig.indenters["cone60"], Indenter::Cone { diameter_mm: 4.0, apex_deg: 60.0 });
    let corners_mm = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.1], [1.0, 1.0, 0.25]];
    let mesh = tactus_model::Mesh::new(&corners_mm, &[[0, 1, 2]]).unwrap();
    assert_eq!(rig.indenters["wedge"], Indenter::Mesh(mesh.into()));
    assert_eq!(Rig::from_json(&rig.to_json()).unwrap().indenters, rig.indenters);

    for (from, to, refusal) in [
        ("apex_deg = 60.0", "apex_deg = 180.0", "indenters.cone60.apex_deg: the full angle"),
        ("[[0, 1, 2]]", "[[0, 1, 7]]", "indenters.wedge.triangles: triangle 0 names vertex 7 of 3"),
    ] {
        let error = Rig::from_toml(&toml.replace(from, to)).unwrap_err().to_string();
        assert!(error.starts_with(refusal), "{error}");
    }
}

#[test]
fn numbers_of_any_spelling_are_read_from_json() {
    let json = Rig::from_toml(SIM).unwrap().to_json();
    let spelt = json.replace("\"baseline_counts\":100.0", "\"baseline_counts\":1e2");
    assert_ne!(json, spelt);
    assert_eq!(Rig::from_json(&spelt).unwrap().baseline_counts, vec![100.0; 48]);
    let listed = json.replace("\"baseline_counts\":100.0", &format!("\"baseline_counts\":{:?}", vec![7; 48]));
    assert_eq!(Rig::from_json(&listed).unwrap().baseline_counts, vec![7.0; 48]);
}
