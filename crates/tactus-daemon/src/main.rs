//! `tactusd`: the lab service.

use std::process::ExitCode;

use tactus_runner::script_process;

fn main() -> ExitCode {
    // A script is evaluated in a process of its own, which is this program again.
    script_process::main_if_child().unwrap_or_else(tactus_daemon::main)
}
