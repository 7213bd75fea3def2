//! How much disk space a recording takes, and how much there is.

use std::{io, path::Path};

use rustix::fs::statvfs;
use tactus_schema::Rig;

use crate::RecordError;

/// No run begins with less free space.
const FREE_MIN_BYTES: u64 = 64 * 1024 * 1024;

/// Room for repeated presses and pauses, which no plan knows.
const MARGIN: f64 = 1.5;

/// A frame besides its counts: times, numbers, and its entry in the index.
const FRAME_BYTES: f64 = 100.0;

/// Reports of the stage and events of the run.
const OTHERS_BYTES_PER_S: f64 = 6000.0;

/// The index of chunks, which stands at the end.
pub(crate) const INDEX_BYTES_PER_CHUNK: u64 = 192;

/// The end of a recording besides its index of chunks and its last messages.
const END_BYTES: u64 = 1024 * 1024;

/// The rate at which a recording of a rig grows at most, without compression, in bytes per second.
pub fn growth_bytes_per_s(rig: &Rig) -> f64 {
    let elements = rig.array.elements() as f64;
    rig.array.rate_hz() * (4.0 * elements + FRAME_BYTES) + OTHERS_BYTES_PER_S
}

/// Space for the end of a recording: its index, what a full disk left in memory, and two seconds of messages.
pub(crate) fn end_bytes(rig: &Rig) -> u64 {
    END_BYTES + whole(2.0 * growth_bytes_per_s(rig))
}

/// Space that must be free before a run begins: for its planned duration, if there is a plan, with a margin.
pub fn needed_bytes(rig: &Rig, planned_s: Option<f64>) -> u64 {
    let data_bytes = whole(planned_s.unwrap_or(0.0).max(0.0) * growth_bytes_per_s(rig) * MARGIN);
    data_bytes.saturating_add(end_bytes(rig)).max(FREE_MIN_BYTES)
}

/// Space on the disk of a folder that this process may use.
///
/// # Errors
/// The system's.
pub fn free_bytes(folder: &Path) -> io::Result<u64> {
    let disk = statvfs(folder)?;
    Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
}

/// Checks that a run of this duration fits on the disk of a folder.
///
/// # Errors
/// [`RecordError::NoSpace`] if it does not.
pub fn check_free(folder: &Path, rig: &Rig, planned_s: Option<f64>) -> Result<(), RecordError> {
    let error = |source| RecordError::Io { action: "look at the disk of", path: folder.to_owned(), source };
    let (needed_bytes, free_bytes) = (needed_bytes(rig, planned_s), free_bytes(folder).map_err(error)?);
    if free_bytes < needed_bytes {
        return Err(RecordError::NoSpace { folder: folder.to_owned(), needed_bytes, free_bytes });
    }
    Ok(())
}

fn whole(bytes: f64) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates; it is no negative number"
    )]
    let whole = bytes.ceil() as u64;
    whole
}

#[cfg(test)]
#[path = "space_tests.rs"]
mod tests;
