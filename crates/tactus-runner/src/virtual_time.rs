//! A runtime with virtual time: it jumps to the next timer whenever every task waits.

use tokio::runtime::{Builder, Runtime};

/// A runtime on the caller's thread with paused time. One thread, so that two runs are identical.
///
/// # Errors
/// If the system provides no runtime.
pub(crate) fn runtime() -> std::io::Result<Runtime> {
    Builder::new_current_thread().enable_time().start_paused(true).build()
}
