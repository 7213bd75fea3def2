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

/// 95 % of 4095 counts less a baseline of 100 are 3,790; the band takes 500 of them.
#[test]
fn an_element_that_could_saturate_before_its_limit_is_refused() {
    let limit =
        |counts: u32| SIM.replace("element_max_counts = 2000.0", &format!("element_max_counts = {counts}.0"));
    Rig::from_toml(&limit(3290)).unwrap();
    let error = Rig::from_toml(&limit(3291)).unwrap_err().to_string();
    assert!(
        error.starts_with("envelope.element_max_counts")
            && error.contains("5 % of full scale before the end"),
        "{error}"
    );
}

/// 5 % of 4095 counts above -1000 are -795; the elements rest at 100 and fall. Where readings have a sign that is not said, they end at -4095.
#[test]
fn an_element_that_falls_has_its_end_at_the_least_count() {
    let falls = SIM
        .replace("full_scale_counts = 4095", "least_counts = -1000\nfull_scale_counts = 4095")
        .replace("sensitivity_counts_per_mm = 1000.0", "sensitivity_counts_per_mm = -1000.0");
    assert_eq!(falls.matches("-1000").count(), 2, "both are replaced");
    let limited = |text: &str, counts: u32| {
        Rig::from_toml(
            &text.replace("element_max_counts = 2000.0", &format!("element_max_counts = {counts}.0")),
        )
    };
    let rig = limited(&falls, 395).unwrap();
    assert_eq!(Rig::from_json(&rig.to_json()).unwrap().array, rig.array);
    let error = limited(&falls, 396).unwrap_err().to_string();
    assert!(error.starts_with("envelope.element_max_counts") && error.contains("only 895"), "{error}");
    let signed = SIM
        .replace("baseline_counts = 100.0", "baseline_counts = 0.0")
        .replace("sensitivity_counts_per_mm = 1000.0", "sensitivity_counts_per_mm = -1000.0");
    limited(&signed, 3390).unwrap();
    limited(&signed, 3391).unwrap_err();
    let error = refused("full_scale_counts = 4095", "least_counts = 5000\nfull_scale_counts = 4095");
    assert!(error.contains("least_counts") && error.contains("below full_scale_counts"), "{error}");
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

/// The shipped rig with another `[sensor]`; `array` changes the array.
fn with_sensor(sensor: &str, array: &[(&str, &str)]) -> Result<SensorProtocol, String> {
    let mut toml = SIM.replace("protocol = \"weiss-dsa\"", sensor).replace("miswired = ", "# ");
    for (from, to) in array {
        assert!(toml.contains(from), "the shipped rig has no {from:?}");
        toml = toml.replace(from, to);
    }
    let rig = Rig::from_toml(&toml).map_err(|error| error.to_string())?;
    Ok(rig.service.unwrap().sensor.protocol)
}

const ONE_ELEMENT: [(&str, &str); 4] = [
    ("rows = 6", "rows = 1"),
    ("cols = 8", "cols = 1"),
    ("[0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3]", "[7.5]"),
    ("[0.9, 2.9, 4.9, 6.9, 8.9, 10.9]", "[7.5]"),
];

const FIVE_BY_THREE: [(&str, &str); 4] = [
    ("rows = 6", "rows = 5"),
    ("cols = 8", "cols = 3"),
    ("[0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3]", "[0.9, 2.9, 5.1]"),
    ("[0.9, 2.9, 4.9, 6.9, 8.9, 10.9]", "[0.9, 2.9, 4.9, 6.9, 8.9]"),
];

#[test]
fn each_sensor_protocol_has_its_own_keys() {
    let weiss = |checksum| SensorProtocol::WeissDsa { checksum };
    for (sensor, array, want) in [
        ("protocol = \"weiss-dsa\"", &[][..], weiss(WeissChecksum::Crc)),
        ("protocol = \"weiss-dsa\"\nchecksum = \"crc\"", &[], weiss(WeissChecksum::Crc)),
        ("protocol = \"weiss-dsa\"\nchecksum = \"sum8\"", &[], weiss(WeissChecksum::Sum8)),
        (
            "protocol = \"singletact\"\naddresses = [4]",
            &ONE_ELEMENT,
            SensorProtocol::SingleTact { addresses: vec![4] },
        ),
        ("protocol = \"anyskin\"", &FIVE_BY_THREE, SensorProtocol::AnySkin),
        (
            "protocol = \"declared\"\nformat = \"../links/digitacts.toml\"",
            &[],
            SensorProtocol::Declared { format: "../links/digitacts.toml".into() },
        ),
    ] {
        assert_eq!(with_sensor(sensor, array).unwrap(), want);
    }
}

#[test]
fn keys_of_another_sensor_protocol_and_contradictions_are_refused() {
    for (sensor, array, refusal) in [
        (
            "protocol = \"anyskin\"\nchecksum = \"crc\"",
            &FIVE_BY_THREE[..],
            "sensor.checksum: belongs to protocol = \"weiss-dsa\", not to \"anyskin\"",
        ),
        ("protocol = \"weiss-dsa\"\naddresses = [4]", &[], "sensor.addresses: belongs to"),
        (
            "protocol = \"singletact\"\naddresses = [4]\nformat = \"a\"",
            &ONE_ELEMENT,
            "sensor.format: belongs to",
        ),
        ("protocol = \"singletact\"", &ONE_ELEMENT, "sensor.addresses: missing"),
        (
            "protocol = \"singletact\"\naddresses = [128]",
            &ONE_ELEMENT,
            "sensor.addresses: 128 is no I2C address",
        ),
        (
            "protocol = \"singletact\"\naddresses = [4, 5]",
            &ONE_ELEMENT,
            "sensor.addresses: lists 2 addresses, one for each element, but array.rows and array.cols say 1 x 1",
        ),
        ("protocol = \"declared\"", &[], "sensor.format: missing"),
        (
            "protocol = \"anyskin\"",
            &[],
            "sensor.protocol: \"anyskin\" is 5 magnetometers by 3 axes, but array.rows and array.cols say 6 x 8",
        ),
    ] {
        let error = with_sensor(sensor, array).unwrap_err();
        assert!(error.starts_with(refusal), "{error}");
    }
    let two = [("rows = 6", "rows = 1"), ("cols = 8", "cols = 2")];
    let centres = [
        ("[0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3]", "[0.9, 2.9]"),
        ("[0.9, 2.9, 4.9, 6.9, 8.9, 10.9]", "[0.9]"),
    ];
    let error =
        with_sensor("protocol = \"singletact\"\naddresses = [5, 5]", &[two, centres].concat()).unwrap_err();
    assert!(error.starts_with("sensor.addresses: 5 is there twice"), "{error}");
}
