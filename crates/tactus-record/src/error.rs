//! What can go wrong with a recording.

use std::{fmt, io, path::PathBuf};

use tactus_schema::RigError;

use crate::{MessageKind, rig_groups::RigGroups, table::TableError};

/// Why a recording could not be written or read.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum RecordError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
    /// A message could not be encoded.
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: mcap::McapError },
    /// The disk did not take what was to be recorded.
    #[error("cannot write {}: {source}{missing}", path.display())]
    Store { path: PathBuf, source: io::Error, missing: Missing },
    /// The file is not where it was while it is being written.
    #[error("{} was deleted, moved or replaced while it was written: what is recorded is lost", path.display())]
    Vanished { path: PathBuf },
    /// The disk has too little space for a recording.
    #[error("too little space for a recording in {}: {} are free, {} are needed: delete what is not needed, or name a folder on another disk (`recordings` in a service's configuration, `--out` of a command)", folder.display(), in_mib(*free_bytes), in_mib(*needed_bytes))]
    NoSpace { folder: PathBuf, needed_bytes: u64, free_bytes: u64 },
    /// The file does not begin as an MCAP file does.
    #[error("{} is not an MCAP file", path.display())]
    NotMcap { path: PathBuf },
    /// The file is MCAP, but not a recording of a run, or it was cut off before it said which run it is.
    #[error("{}: no metadata record {:?}, so this is no recording of a run, or its first bytes are lost: `tactus recover` tries to go without them", path.display(), crate::header::METADATA_NAME)]
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

/// What a recording lacks after its storage failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Missing {
    /// Number of messages that are not in the file.
    pub messages: u64,
    /// Number of frames among them.
    pub frames: u64,
    /// True once the recording is over, so that the numbers are final.
    pub told: bool,
    /// True if the end of the recording could not be written either.
    pub unclosed: bool,
}

impl Missing {
    pub(crate) fn one(kind: MessageKind) -> Self {
        Self::message(kind == MessageKind::Frame)
    }

    /// One message, which may be a frame.
    pub fn message(is_frame: bool) -> Self {
        Self { messages: 1, frames: u64::from(is_frame), ..Self::default() }
    }

    /// What this and something else lack; the rest is as here.
    #[must_use]
    pub fn plus(self, more: Self) -> Self {
        Self { messages: self.messages + more.messages, frames: self.frames + more.frames, ..self }
    }
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { messages, frames, told, unclosed } = self;
        match messages {
            0 if *told => f.write_str("; nothing is missing of what was received until then")?,
            0 => {}
            _ => write!(f, "; {messages} messages are missing, {frames} of them frames")?,
        }
        if *unclosed {
            f.write_str("; the recording has no end: the service closes it at its next start, `tactus recover` at once")?;
        }
        Ok(())
    }
}

fn in_mib(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / (1024.0 * 1024.0))
}

/// Why recordings and measurement tables gave no rows, or no table could be made of them.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum RowsError {
    /// No file was named.
    #[error("no recording or measurement table was named")]
    Nothing,
    /// The file has no bytes.
    #[error("{} is empty: nothing was written to it", path.display())]
    Empty { path: PathBuf },
    /// The file is of another kind.
    #[error("{} is neither a recording (MCAP) nor a measurement table (Parquet): only these hold measured rows. `tactus import` makes a table of another file", path.display())]
    Neither { path: PathBuf },
    /// A recording could not be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A table could not be read or written, or a row breaks its contract.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Files that are read together must be of one array at one place, with the same tools.
    #[error("{} was made with another rig than {}: {difference}. {groups}", path.display(), first.display())]
    RigsDiffer { first: PathBuf, path: PathBuf, difference: String, groups: RigGroups },
    /// No run may be in two files.
    #[error("{} holds run {run:?}, which was taken already", path.display())]
    RunTwice { path: PathBuf, run: String },
    /// The recording has no position of the stage.
    #[error("{}: no position of the stage was recorded", path.display())]
    NoStage { path: PathBuf },
}
