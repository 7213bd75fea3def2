//! `tactus-web`: the dashboard.

use std::process::ExitCode;

fn main() -> ExitCode {
    tactus_web::main()
}
