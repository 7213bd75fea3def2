use tactus_runner::embedded::SIMULATED_RIG;

use super::*;

fn told(name: &str, rig_toml: &str) -> anyhow::Result<Described> {
    let rig_toml = rig_toml.replacen("name = \"sim\"", &format!("name = {name:?}"), 1);
    described(name, pb::CommandReply { rig_toml, ..Default::default() })
}

#[test]
fn a_rig_is_recorded_if_its_name_is_the_name_of_a_folder() {
    assert_eq!(told("left", SIMULATED_RIG).unwrap().rig.name, "left");
    // Descriptions of rigs that are not in service may have any name.
    let not_in_service = SIMULATED_RIG.split("[motion]").next().unwrap();
    assert!(told("left", not_in_service).is_err());
    for name in ["..", "a/b", "/tmp"] {
        assert!(told(name, SIMULATED_RIG).is_err(), "{name}");
        assert!(told(name, not_in_service).is_err(), "{name}");
    }
}

#[test]
fn a_rig_has_started_again_if_its_publishers_are_new_or_its_frames_are_counted_anew() {
    let frame = |seq| Heard::frame(pb::Frame { seq, ..pb::Frame::default() });
    let mut start = Start { publishers: 1, frame: None };
    let told = [
        (1, frame(7)),
        (1, frame(8)),
        (2, Heard::Stage(pb::StageState::default())),
        (2, frame(0)),
        (1, Heard::Info(pb::SensorInfo::default())),
        (2, frame(5)),
        (2, frame(1)),
        (2, frame(2)),
    ];
    let anew = told.map(|(publishers, heard)| start.begun(publishers, &heard) == Begun::Anew);
    assert_eq!(anew, [false, false, true, false, false, false, true, false]);
}
