//! `tactus`: the command line and terminal view.

use std::process::ExitCode;

fn main() -> ExitCode {
    tactus::main()
}
