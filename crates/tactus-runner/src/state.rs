//! The folder in which a program keeps what must outlast it.

use std::env;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt as _;
use std::path::PathBuf;

/// The state directory of a systemd service: the first one in `$STATE_DIRECTORY`.
pub fn of_service() -> Option<PathBuf> {
    let listed = env::var_os("STATE_DIRECTORY")?;
    let first = listed.as_bytes().split(|byte| *byte == b':').next()?;
    (!first.is_empty()).then(|| PathBuf::from(OsStr::from_bytes(first)))
}

/// The state directory: that of the service, else `$XDG_STATE_HOME/tactus`, else `~/.local/state/tactus`.
pub fn folder() -> Option<PathBuf> {
    let of = |variable: &str| env::var_os(variable).filter(|value| !value.is_empty()).map(PathBuf::from);
    let of_user = || of("XDG_STATE_HOME").map(|state| state.join("tactus"));
    let of_home = || of("HOME").map(|home| home.join(".local/state/tactus"));
    of_service().or_else(of_user).or_else(of_home)
}
