//! `tactusd`: the lab service. [`service`] composes it of the bus, the engine and `tactus-runner`.

mod notify;
mod service;

use std::process::ExitCode;

fn main() -> ExitCode {
    service::main()
}
