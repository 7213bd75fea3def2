//! What a session wants done, and tells.

use core::time::Duration;

use crate::zaber::{AxisName, Flag, Rejection};

/// What the session wants done, or tells.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Write these bytes.
    Send(Vec<u8>),
    /// Every device answered; commands are taken from here on.
    Connected {
        /// The devices and their firmware.
        identity: String,
    },
    /// Where the stage stands and what it does; after each round of questions, and when its status changes
    /// without one.
    Report(Report),
    /// An axis no longer knows where it is: it was restarted, or pushed while it stood. The position is
    /// suspect.
    ReferenceLost {
        /// Which axis.
        name: AxisName,
    },
    /// The command in hand has ended; the position, mm, is where the stage stands.
    Done(Result<[f64; 3], Failure>),
    /// The session is over.
    Failed(SessionError),
}

/// Where the stage stands and what it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// As last reported. The axes are asked one after another, within some 15 ms.
    pub position_mm: [f64; 3],
    /// What it does.
    pub status: Status,
    /// What is wrong, in an alarm.
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
    /// It comes to a stand.
    Hold,
    /// It looks for its reference position.
    Homing,
    /// It takes no moves until the alarm is cleared.
    Alarm,
}

/// A fault that stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alarm {
    /// Of which axis.
    pub name: AxisName,
    /// Which; see [`Flag::meaning`] and [`Flag::code`].
    pub flag: Flag,
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
    /// An axis is at fault.
    Alarm(Alarm),
    /// The position is not known.
    Unhomed,
    /// Someone else moved an axis meanwhile, by its knob or by a command of another host; the stage was
    /// stopped.
    Interrupted {
        /// Which axis.
        name: AxisName,
        /// What it said: [`Flag::MANUAL_CONTROL`] or [`Flag::INTERRUPTED`].
        flag: Flag,
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

/// Why a session is over.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SessionError {
    /// A device never answered.
    #[error(
        "device {device} does not answer: does it speak Zaber's ASCII protocol, and is the bit rate right?"
    )]
    NoDevice {
        /// Its address.
        device: u8,
    },
    /// A device stopped answering.
    #[error("device {device} did not answer to {command:?}")]
    Silent {
        /// Its address.
        device: u8,
        /// What was asked.
        command: String,
    },
    /// A device refused a question without which nothing can be done.
    #[error("device {device} refused {command:?}: {rejection}")]
    Refused {
        /// Its address.
        device: u8,
        /// What was asked.
        command: String,
        /// Why.
        rejection: Rejection,
    },
    /// A device has fewer axes than are to be used.
    #[error("device {device} has {axis_count} axes, but the rig uses its axis {number} as {name}")]
    NoAxis {
        /// Its address.
        device: u8,
        /// The number of the axis.
        number: u8,
        /// As what it is used.
        name: AxisName,
        /// How many it has.
        axis_count: i64,
    },
}

impl Failure {
    /// The same, now that the stage stands at `position_mm`.
    pub(super) fn at(self, position_mm: [f64; 3]) -> Self {
        match self {
            Self::Stopped { .. } => Self::Stopped { position_mm },
            Self::Overdue { target_mm, waited, .. } => Self::Overdue { target_mm, position_mm, waited },
            Self::Interrupted { name, flag, .. } => Self::Interrupted { name, flag, position_mm },
            Self::Refused { .. } | Self::Alarm(_) | Self::Unhomed | Self::NotThere { .. } => self,
        }
    }
}
