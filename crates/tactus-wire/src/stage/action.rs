//! What a session wants done, and tells.

use core::time::Duration;

use super::AxisName;

/// What the session wants done, or tells; `E` is why it may be over.
#[derive(Debug, Clone, PartialEq)]
pub enum Action<E> {
    /// Write these bytes.
    Send(Vec<u8>),
    /// The controller answered and is the one that was described; commands are taken from here on.
    Connected(Controller),
    /// Where it stands and what it does; at each report, and when its status changes without one.
    Report(Report),
    /// The position is not to be trusted any more, by no doing of this session.
    Suspect {
        /// What happened.
        why: String,
    },
    /// The command in hand has ended; the position is where the stage stands.
    Done(Result<[f64; 3], Failure>),
    /// The session is over.
    Failed(E),
}

/// What answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Controller {
    /// Its name and version, in its own words.
    pub identity: String,
    /// Its settings that matter to a stage.
    pub settings: Vec<Setting>,
}

/// A setting of the controller, as it tells it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Its name in the protocol.
    pub name: String,
    /// Its value.
    pub value: String,
    /// What it is.
    pub meaning: String,
}

/// Where the stage stands and what it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// As last reported. Where axes are asked one after another, that takes some 15 ms.
    pub position_mm: [f64; 3],
    /// What it does.
    pub status: Status,
    /// What is wrong, in an alarm that was told.
    pub alarm: Option<Alarm>,
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
    /// It holds, or comes to a stand.
    Hold,
    /// It looks for its reference position.
    Homing,
    /// It takes no commands until the alarm is cleared.
    Alarm,
}

/// A fault of the controller that must be seen to and cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alarm {
    /// The controller's number, 0 if it was not told; two characters, the first in the high byte, where the protocol
    /// has letters: `FS` is 0x4653.
    pub code: u16,
    /// Of which axis, where the protocol tells that.
    pub axis: Option<AxisName>,
    /// What it means and what to do.
    pub meaning: &'static str,
}

/// Why a command did not do what was asked.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// [`Session::stop`](super::Session::stop) ended it.
    Stopped {
        /// Where the stage stands.
        position_mm: [f64; 3],
    },
    /// The controller refused it, did not confirm it, or it cannot be done.
    Refused {
        /// The command.
        command: String,
        /// Why, in words.
        reason: String,
    },
    /// The controller is in alarm.
    Alarm(Alarm),
    /// The position is not known.
    Unhomed,
    /// Someone else moved an axis meanwhile, by its knob or by a command of another host; the stage was
    /// stopped.
    Interrupted {
        /// Which axis.
        axis: AxisName,
        /// What it said, in words.
        meaning: &'static str,
        /// Where the stage stands.
        position_mm: [f64; 3],
    },
    /// The stage stands elsewhere.
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

/// What kind of thing ended a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Nothing answers, or nothing does any more.
    Silent,
    /// What answers does not know what is asked.
    Protocol,
    /// It is not the stage that was described.
    Mismatch,
}

impl Alarm {
    /// Its short name, `1` or `z FS` for instance.
    pub fn name(&self) -> String {
        let code = match self.code.to_be_bytes() {
            [0, number] => number.to_string(),
            letters => letters.map(char::from).iter().collect(),
        };
        self.axis.map_or(code.clone(), |axis| format!("{axis} {code}"))
    }
}

impl Failure {
    pub(crate) fn refused(command: &str, reason: impl Into<String>) -> Self {
        Self::Refused { command: command.to_owned(), reason: reason.into() }
    }

    /// The same, now that the stage stands at `position_mm`.
    pub(crate) fn at(self, position_mm: [f64; 3]) -> Self {
        match self {
            Self::Stopped { .. } => Self::Stopped { position_mm },
            Self::Overdue { target_mm, waited, .. } => Self::Overdue { target_mm, position_mm, waited },
            Self::Interrupted { axis, meaning, .. } => Self::Interrupted { axis, meaning, position_mm },
            Self::Refused { .. } | Self::Alarm(_) | Self::Unhomed | Self::NotThere { .. } => self,
        }
    }
}
