//! `fleet`: hands over to `tactus-fleet`, which is built by itself.

use std::env;
use std::ffi::OsString;
use std::io;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::Command;

use anyhow::Context as _;

use crate::cli::Common;
use crate::exit::{Exit, Failure};

/// Name of the program.
const PROGRAM: &str = "tactus-fleet";

/// Replaces this process by the program beside it, else by the one on `PATH`.
pub(crate) fn fleet(common: &Common, args: &[OsString]) -> anyhow::Result<Exit> {
    let program = beside().unwrap_or_else(|| PROGRAM.into());
    let error = Command::new(&program).args(common.json.then_some("--json")).args(args).exec();
    if error.kind() == io::ErrorKind::NotFound {
        let message = "tactus-fleet is neither beside this program nor on PATH. It is built by itself: \
                       `cargo build --release --manifest-path fleet/Cargo.toml` in the repository; then put fleet/target/release on PATH";
        return Err(Failure::new(Exit::Failed, message).into());
    }
    Err(error).with_context(|| program.display().to_string())
}

fn beside() -> Option<PathBuf> {
    let program = env::current_exe().ok()?.parent()?.join(PROGRAM);
    program.is_file().then_some(program)
}
