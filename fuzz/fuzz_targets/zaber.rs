//! Any bytes from a `zaber-ascii` stage while it is given commands: no session panics, and every command ends at most once.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::run_stage;
use tactus_wire::stage::Direction;
use tactus_wire::zaber::{Axis, Config, Session};

fuzz_target!(|input: &[u8]| {
    let axis = |number| {
        Some(Axis {
            device: 1,
            number,
            um_per_microstep: 0.05,
            direction: Direction::Positive,
            origin_microsteps: 0,
            resolution: None,
        })
    };
    let config = Config {
        axes: [1, 2, 3].map(axis),
        tolerance_mm: 0.005,
        accel_mm_per_s2: None,
        homing_speed_mm_per_s: None,
        checksums: false,
        trusts_reference: true,
    };
    match Session::new(config) {
        Ok(session) => run_stage(session, input),
        Err(error) => unreachable!("three axes of one device: {error}"),
    }
});
