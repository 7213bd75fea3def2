//! The exit codes.

use std::fmt;
use std::io;
use std::process::ExitCode;

use tactus_schema::pb::ExitStatus;

use crate::source_line::with_source_line;

/// How the program ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Done.
    Done = 0,
    /// Failed: the message says what, where, and what to do.
    Failed = 1,
    /// Usage: a wrong command line, file or script. Nothing was done.
    Usage = 2,
    /// Done, but something was lost or is missing; the message says what.
    Degraded = 3,
    /// Refused by safety: a limit, or a reset that is needed. The refused step was not done.
    Refused = 4,
    /// Not now: another run is in progress, or another client holds the lease.
    NotNow = 5,
}

/// An error with an exit code. Other errors exit with [`Exit::Failed`].
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) exit: Exit,
    message: String,
}

impl Failure {
    pub(crate) fn new(exit: Exit, message: impl fmt::Display) -> Self {
        Self { exit, message: message.to_string() }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

impl Exit {
    /// The exit code of a run.
    pub(crate) fn of_run(status: ExitStatus) -> Self {
        match status {
            ExitStatus::Done => Self::Done,
            ExitStatus::Degraded => Self::Degraded,
            ExitStatus::Refused => Self::Refused,
            ExitStatus::Unspecified
            | ExitStatus::Failed
            | ExitStatus::Stopped
            | ExitStatus::Aborted
            | ExitStatus::Crashed => Self::Failed,
        }
    }

    /// The exit code in the service's answer.
    pub(crate) fn of_reply(code: u32) -> Self {
        [Self::Done, Self::Failed, Self::Usage, Self::Degraded, Self::Refused, Self::NotNow]
            .into_iter()
            .find(|exit| *exit as u32 == code)
            .unwrap_or(Self::Failed)
    }

    /// The exit code of an error.
    pub(crate) fn of_error(error: &anyhow::Error) -> Self {
        error.downcast_ref::<Failure>().map_or(Self::Failed, |failure| failure.exit)
    }
}

/// The error in words, with the line of the script that it names.
pub(crate) fn at_source(error: &anyhow::Error, name: &str, source: &str) -> anyhow::Error {
    Failure::new(Exit::of_error(error), with_source_line(&in_words(error), name, source)).into()
}

/// An error with its causes. A cause that the text contains already is not repeated.
pub(crate) fn in_words(error: &anyhow::Error) -> String {
    let mut words = String::new();
    for cause in error.chain().map(ToString::to_string).filter(|cause| !cause.is_empty()) {
        if !words.contains(&cause) {
            words.push_str(if words.is_empty() { "" } else { ": " });
            words.push_str(&cause);
        }
    }
    let is_folder = |cause: &(dyn std::error::Error + 'static)| {
        cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::IsADirectory)
    };
    if error.chain().any(is_folder) {
        words.push_str("; name files of this folder, not the folder");
    }
    words
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
