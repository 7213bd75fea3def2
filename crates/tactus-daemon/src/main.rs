//! `tactusd`: the lab service. [`service`] composes it of the bus, the engine and `tactus-runner`.

mod inhibitor;
mod notify;
mod service;

use std::process::ExitCode;

use tactus_runner::script_process;

fn main() -> ExitCode {
    // A script is evaluated in a process of its own, which is this program again.
    script_process::main_if_child().unwrap_or_else(service::main)
}
