//! What can go wrong with runs.

use std::{io, path::PathBuf};

use tactus_record::RecordError;
use tactus_report::ReportError;

/// Why runs could not be listed, found, marked, compared or made again.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum RunsError {
    /// There is no such folder.
    #[error("no folder {}: name the folder of the recordings with --runs DIR; the installed service records in {}", folder.display(), crate::INSTALLED)]
    NoFolder { folder: PathBuf },
    /// No run has this id.
    #[error("no run {id:?} in {}: `tactus runs` lists them", folder.display())]
    Unknown { id: String, folder: PathBuf },
    /// Several runs have this part of an id.
    #[error("{id:?} is one of {}: which?", ids.join(", "))]
    Several { id: String, ids: Vec<String> },
    /// A comparison of fewer than two.
    #[error("it takes two runs to compare")]
    TooFew,
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
    /// The notes of a run are no notes.
    #[error("{}: {source}", path.display())]
    Notes { path: PathBuf, source: toml::de::Error },
    /// Notes cannot be written as TOML.
    #[error("{}: {source}", path.display())]
    Unwritable { path: PathBuf, source: toml::ser::Error },
    /// A recording could not be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A run's results could not be read.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The recording lacks what a repetition needs.
    #[error("{}: the recording lacks its {what}", path.display())]
    Lacks { path: PathBuf, what: &'static str },
}

impl RunsError {
    /// True if another argument is what helps.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::NoFolder { .. } | Self::Unknown { .. } | Self::Several { .. })
    }
}
