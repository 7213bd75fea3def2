//! What tests of recordings begin with.

use std::collections::BTreeMap;

use tactus_schema::{Rig, WallTime};

use crate::{Header, Script};

const RIG_TOML: &str = include_str!("../../../config/rigs/sim.toml");

/// Calls a function with the header of a run on the simulated rig.
pub(crate) fn with_header<T>(use_it: impl FnOnce(&Header<'_>) -> T) -> T {
    use_it(&Header {
        run_id: "r1",
        experiment: "corners",
        who: "ada",
        rig: &Rig::from_toml(RIG_TOML).unwrap(),
        rig_toml: Some(RIG_TOML),
        link_toml: Some("schema = \"tactus.link/1\""),
        script: Script { name: "corners.star", source: "" },
        versions: &BTreeMap::new(),
        parameters_json: "{}",
        started: WallTime::from_ns(1),
        simulated: true,
        continues: None,
    })
}
