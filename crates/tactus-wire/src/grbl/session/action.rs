//! What a session is asked, wants done, and tells.

use core::time::Duration;

/// What is asked of the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// A move is done when the controller stands within this of the target.
    pub tolerance_mm: f64,
}

/// What the session wants done, or tells.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Write these bytes.
    Send(Vec<u8>),
    /// The controller answered; commands are taken from here on.
    Connected {
        /// Its banner.
        banner: String,
    },
    /// Where it stands and what it does; at each report, and when its status changes without one.
    Report(Report),
    /// The controller was reset, not by this session: what it was doing is off, and its position is suspect.
    Reset {
        /// Its banner.
        banner: String,
    },
    /// The command in hand has ended; the position is where the stage stands.
    Done(Result<[f64; 3], Failure>),
    /// The session is over.
    Failed(SessionError),
}

/// Where the stage stands and what it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// As last reported.
    pub position_mm: [f64; 3],
    /// What it does.
    pub status: Status,
    /// The alarm's number, in an alarm that was told with one.
    pub alarm: Option<u8>,
}

/// What the stage does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// It stands, at a place that is not to be trusted until it is homed.
    Unhomed,
    /// It stands.
    Idle,
    /// It moves.
    Moving,
    /// It holds, or comes to a hold.
    Hold,
    /// It looks for its reference position.
    Homing,
    /// It takes no commands until the alarm is cleared.
    Alarm,
}

/// Why a command did not do what was asked.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// [`Session::stop`](super::Session::stop) ended it.
    Stopped {
        /// Where the stage stands.
        position_mm: [f64; 3],
    },
    /// The controller refused it, or it cannot be done.
    Refused {
        /// The command.
        command: String,
        /// Why, in words.
        reason: String,
    },
    /// The controller is in alarm; see [`alarm_meaning`](crate::grbl::alarm_meaning).
    Alarm {
        /// Its number; 0 if it was not told.
        code: u8,
    },
    /// The position is not known.
    Unhomed,
    /// The controller stands elsewhere.
    NotThere {
        /// Where it was sent.
        target_mm: [f64; 3],
        /// Where it says it is.
        position_mm: [f64; 3],
    },
    /// The move took longer than it can; the stage was stopped.
    Overdue {
        /// Where it was sent.
        target_mm: [f64; 3],
        /// Where it says it is.
        position_mm: [f64; 3],
        /// How long was waited.
        waited: Duration,
    },
}

/// Why a session is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SessionError {
    /// No banner came.
    #[error("no banner came after {resets} resets: is this a Grbl controller, and is the bit rate right?")]
    NoBanner {
        /// How often the controller was reset.
        resets: u32,
    },
    /// The controller stopped answering.
    #[error("the controller did not answer {question}")]
    Silent {
        /// What was asked.
        question: &'static str,
    },
}

impl Failure {
    /// The same, now that the stage stands at `position_mm`.
    pub(super) fn at(self, position_mm: [f64; 3]) -> Self {
        match self {
            Self::Stopped { .. } => Self::Stopped { position_mm },
            Self::Overdue { target_mm, waited, .. } => Self::Overdue { target_mm, position_mm, waited },
            Self::Refused { .. } | Self::Alarm { .. } | Self::Unhomed | Self::NotThere { .. } => self,
        }
    }
}
