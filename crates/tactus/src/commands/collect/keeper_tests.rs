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
