//! `tactus-fleet`: many recordings asked at once.

use std::process::ExitCode;

fn main() -> ExitCode {
    tactus_fleet::main()
}
