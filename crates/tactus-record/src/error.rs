//! What can go wrong with a recording.

use std::{io, path::PathBuf};

use tactus_schema::RigError;

use crate::table::TableError;

/// Why a recording could not be written or read.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum RecordError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
    /// A message could not be stored: what was taken in before may be incomplete.
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: mcap::McapError },
    /// The file does not begin as an MCAP file does.
    #[error("{} is not an MCAP file", path.display())]
    NotMcap { path: PathBuf },
    /// The file is MCAP, but not a recording of a run, or it was cut off before it said which run it is.
    #[error("{}: no metadata record {:?}, so this is no recording of a run, or its first bytes are lost", path.display(), crate::header::METADATA_NAME)]
    NoRun { path: PathBuf },
    /// An attachment or metadata field of the recording's start is missing or wrong.
    #[error("{}: {what}: {problem}", path.display())]
    Header { path: PathBuf, what: String, problem: String },
    /// The rig in the recording is not a rig.
    #[error("{}: rig.json: {source}", path.display())]
    Rig { path: PathBuf, source: RigError },
    /// Recovery was asked for a recording that lacks nothing.
    #[error("{} is whole and its run is closed: there is nothing to recover", path.display())]
    NothingToRecover { path: PathBuf },
    /// What recovery wrote does not read back as what was meant; the output was removed.
    #[error("{}: the recovered file does not read back: {problem}", path.display())]
    Unverified { path: PathBuf, problem: String },
}

/// Why recordings and measurement tables gave no rows, or no table could be made of them.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum RowsError {
    /// No file was named.
    #[error("no recording or measurement table was named")]
    Nothing,
    /// The file is of another kind.
    #[error("{} is neither a recording (MCAP) nor a measurement table (Parquet): only these hold measured rows", path.display())]
    Neither { path: PathBuf },
    /// A recording could not be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A table could not be read or written, or a row breaks its contract.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Files that are read together must be of one rig.
    #[error("{} was made with another rig than {}: take them apart", path.display(), first.display())]
    RigsDiffer { first: PathBuf, path: PathBuf },
    /// No run may be in two files.
    #[error("{} holds run {run:?}, which was taken already", path.display())]
    RunTwice { path: PathBuf, run: String },
    /// The stage never said where it was.
    #[error("{}: no position of the stage was recorded", path.display())]
    NoStage { path: PathBuf },
}
