use super::*;
use crate::Rig;

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

const GRBL: &str = "protocol = \"grbl\"\n";

const ZABER: &str = "protocol = \"zaber-ascii\"
axes.x = { device = 1, axis = 1, um_per_microstep = 0.047625, direction = 1 }
axes.y = { device = 1, axis = 2, um_per_microstep = 0.047625 }
axes.z = { device = 2, axis = 1, um_per_microstep = 0.5, direction = -1, origin_microsteps = 40_000, resolution = 64 }
";

/// The rig's stage with these lines in the place of its protocol.
fn stage(lines: &str) -> Result<StageProtocol, String> {
    let toml = SIM.replace(GRBL, &format!("{lines}\n"));
    assert_ne!(toml, SIM, "the shipped rig has no {GRBL:?}");
    let rig = Rig::from_toml(&toml).map_err(|error| error.to_string())?;
    Ok(rig.service.unwrap().stage.protocol)
}

fn zaber(from: &str, to: &str) -> Result<StageProtocol, String> {
    assert!(ZABER.contains(from), "{from}");
    stage(&ZABER.replace(from, to))
}

#[test]
fn a_grbl_stage_needs_nothing_but_its_protocol() {
    assert_eq!(stage(GRBL), Ok(StageProtocol::Grbl(GrblAxes::default())));
    assert_eq!(stage(GRBL).unwrap().name(), "grbl");
}

#[test]
fn axes_of_grbl_may_be_exchanged_turned_and_shifted() {
    let lines = "protocol = \"grbl\"\nsoft_limits = false\n\
                 axes.x = { machine_axis = \"y\", direction = -1, steps_per_mm = 250.0 }\n\
                 axes.y = { machine_axis = \"x\" }\naxes.z.origin_mm = -30";
    let Ok(StageProtocol::Grbl(GrblAxes { axes: [x, y, z], soft_limits: false })) = stage(lines) else {
        panic!("{:?}", stage(lines));
    };
    let turned = GrblAxis {
        machine_axis: MachineAxis::Y,
        is_forward: false,
        origin_mm: 0.0,
        steps_per_mm: Some(250.0),
        home: None,
    };
    assert_eq!(x, turned);
    assert_eq!((y.machine_axis, y.is_forward, y.steps_per_mm), (MachineAxis::X, true, None));
    assert_eq!((z.machine_axis, z.origin_mm.to_bits()), (MachineAxis::Z, (-30.0_f64).to_bits()));
}

#[test]
fn z_homes_upwards_and_the_rig_file_says_where_the_others_home() {
    let lines = "protocol = \"grbl\"\naxes.x.home = \"low\"\naxes.z.home = \"high\"";
    let Ok(StageProtocol::Grbl(GrblAxes { axes: [x, y, z], .. })) = stage(lines) else { panic!() };
    assert_eq!((x.home, y.home, z.home), (Some(AxisEnd::Low), None, Some(AxisEnd::High)));
    let down = stage("protocol = \"grbl\"\naxes.z.home = \"low\"").unwrap_err();
    assert!(down.contains("into the sensor"), "{down}");
}

#[test]
fn a_zaber_stage_names_its_axes() {
    let Ok(StageProtocol::Zaber(zaber)) = stage(ZABER) else { panic!("{:?}", stage(ZABER)) };
    let z = ZaberAxis {
        device: 2,
        axis: 1,
        um_per_microstep: 0.5,
        is_forward: false,
        origin_microsteps: 40_000,
        resolution: Some(64),
    };
    assert_eq!(zaber.axes[2], Some(z));
    assert_eq!(
        zaber.axes[1].map(|y| (y.device, y.axis, y.is_forward, y.resolution)),
        Some((1, 2, true, None))
    );
    assert!(zaber.checksums && !zaber.trusts_reference && zaber.accel_mm_per_s2.is_none());
    assert_eq!(stage(ZABER).unwrap().name(), "zaber-ascii");
}

#[test]
fn wrong_values_are_refused_with_their_field() {
    for (lines, refusal) in [
        (
            "axes.x.direction = 0",
            "stage.axes.x.direction: 1, or -1 if the controller counts the other way; not 0",
        ),
        ("axes.y.steps_per_mm = -250", "stage.axes.y.steps_per_mm"),
        ("axes.z.origin_mm = inf", "stage.axes.z.origin_mm"),
        ("axes.x.machine_axis = \"y\"", "stage.axes.y.machine_axis: serves x already"),
    ] {
        let error = stage(&format!("{GRBL}{lines}")).unwrap_err();
        assert!(error.starts_with(refusal), "{error}");
    }
    for (from, to, refusal) in [
        ("device = 2", "device = 100", "stage.axes.z.device: 1 to 99, not 100"),
        ("axis = 2", "axis = 0", "stage.axes.y.axis: 1 to 9, not 0"),
        ("axis = 2", "axis = 1", "stage.axes.y.axis: the same axis of the same device as x"),
        ("um_per_microstep = 0.5", "um_per_microstep = 0", "stage.axes.z.um_per_microstep"),
        ("direction = -1", "direction = 2", "stage.axes.z.direction"),
        ("resolution = 64", "resolution = 0", "stage.axes.z.resolution"),
        ("axes.z =", "accel_mm_per_s2 = 0\naxes.z =", "stage.accel_mm_per_s2"),
        ("axes.z =", "homing_speed_mm_per_s = -1\naxes.z =", "stage.homing_speed_mm_per_s"),
    ] {
        let error = zaber(from, to).unwrap_err();
        assert!(error.starts_with(refusal), "{error}");
    }
    let no_z = ZABER.lines().filter(|line| !line.starts_with("axes.z")).collect::<Vec<_>>().join("\n");
    assert!(stage(&no_z).unwrap_err().starts_with("stage.axes.z: missing"));
}

#[test]
fn unknown_and_missing_keys_are_refused_by_name() {
    for (lines, key) in [
        (format!("{GRBL}axes.x = {{ device = 1 }}"), "device"),
        (format!("{GRBL}axes.w = {{ direction = 1 }}"), "`w`"),
        (format!("{GRBL}checksums = true"), "checksums"),
        (format!("{GRBL}axes.x.machine_axis = \"a\""), "`a`"),
        ("protocol = \"zaber\"".to_owned(), "`zaber-ascii`"),
        ("protocol = \"zaber-ascii\"".to_owned(), "axes"),
        (ZABER.replace("axis = 2,", ""), "axis"),
        (ZABER.replace("axis = 2,", "axis = 2, steps_per_mm = 250.0,"), "steps_per_mm"),
        (format!("{ZABER}soft_limits = true"), "soft_limits"),
    ] {
        let error = stage(&lines).unwrap_err();
        assert!(error.contains(key) && error.contains("line"), "{key}: {error}");
    }
}

#[test]
fn a_stage_has_a_link_over_which_its_guard_can_stop_it() {
    let (sensor, link) = SIM.split_once("[stage]").unwrap();
    for (transport, is_taken) in [
        ("{ kind = \"serial\", path = \"/dev/ttyACM0\", baud = 115200 }", true),
        ("{ kind = \"tcp\", address = \"127.0.0.1:4000\" }", true),
        (
            "{ kind = \"usb\", vid = 1, pid = 2, interface = 0, endpoint_in = 0x81, endpoint_out = 0x02 }",
            false,
        ),
        ("{ kind = \"hid\", vid = 1, pid = 2 }", false),
    ] {
        let embedded = "transport = { kind = \"embedded\" }";
        assert!(link.contains(embedded), "{link}");
        let link = link.replacen(embedded, &format!("transport = {transport}"), 1);
        let read = Rig::from_toml(&format!("{sensor}[stage]{link}")).map_err(|error| error.to_string());
        assert_eq!(read.is_ok(), is_taken, "{transport}: {read:?}");
        if let Err(error) = read {
            assert!(error.starts_with("stage.transport.kind: serial or tcp"), "{error}");
        }
    }
}
