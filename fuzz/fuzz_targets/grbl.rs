//! Any bytes from a `grbl` stage while it is given commands: no session panics, and every command ends at most once.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::run_stage;
use tactus_wire::grbl::{Axis, Config, Session};
use tactus_wire::stage::{AxisName, Direction};

fuzz_target!(|input: &[u8]| {
    let axis = |machine| Axis { machine, direction: Direction::Positive, origin_mm: 0.0, steps_per_mm: None };
    let axes = [AxisName::X, AxisName::Y, AxisName::Z].map(axis);
    match Session::new(Config { tolerance_mm: 0.005, axes, needs_soft_limits: true }) {
        Ok(session) => run_stage(session, input),
        Err(error) => unreachable!("three different axes: {error}"),
    }
});
