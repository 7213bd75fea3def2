//! The exit codes: 0 done; 1 failed; 2 usage; 3 done, but something was lost; 4 refused by safety; 5 not possible now.

use std::fmt;
use std::process::ExitCode;

use tactus_schema::pb::ExitStatus;

use crate::source_line::with_source_line;

/// How the program ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    Done = 0,
    Failed = 1,
    Usage = 2,
    Degraded = 3,
    Refused = 4,
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
    words
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
