//! Any bytes from a `grbl` stage while it is given commands: no session panics, and every command ends at most once.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::run_stage;
use tactus_wire::grbl::{Config, Session};

fuzz_target!(|input: &[u8]| {
    match Session::new(Config::aligned(0.005)) {
        Ok(session) => run_stage(session, input),
        Err(error) => unreachable!("three different axes: {error}"),
    }
});
