//! `tactusd`: the lab service.

use std::process::ExitCode;

fn main() -> ExitCode {
    tactus_daemon::service::main()
}
