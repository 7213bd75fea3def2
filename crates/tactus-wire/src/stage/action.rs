//! What a stage session asks its driver to do, and what it reports.

use core::time::Duration;

use super::course::nearest_on_line_mm;
use super::{AxisName, distance_mm};

/// What a session asks for or reports. `E` is the error that ends the session.
#[derive(Debug, Clone, PartialEq)]
pub enum Action<E> {
    /// Write these bytes.
    Send(Vec<u8>),
    /// Write these bytes, which set the stage in motion, if that is still permitted. If not, call
    /// [`Session::withhold`](super::Session::withhold) after the other actions.
    Move(Vec<u8>),
    /// The controller answered and matches the configuration. From here on, commands are accepted.
    Connected(Controller),
    /// Position and status; at each report of the controller, and at each other change of status.
    Report(Report),
    /// The position has become doubtful by an event outside this session.
    Suspect {
        /// What happened, for the log.
        why: String,
    },
    /// The command under way has ended. The position is that of the stage, in mm.
    Done(Result<[f64; 3], Failure>),
    /// The session is over.
    Failed(E),
}

/// The controller that answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Controller {
    /// Its name and version, as it reports them.
    pub identity: String,
    /// Its settings that are relevant to a stage.
    pub settings: Vec<Setting>,
}

/// A setting of the controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Its name in the protocol.
    pub name: String,
    /// Its value, as the controller writes it.
    pub value: String,
    /// What it means, in words.
    pub meaning: String,
}

/// Position and status of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// As last reported. A controller that is queried axis by axis takes about 15 ms for all.
    pub position_mm: [f64; 3],
    /// See [`Status`].
    pub status: Status,
    /// The alarm, if the controller reported which one.
    pub alarm: Option<Alarm>,
}

/// Where a homed stage stands whose link is lost: between two places, because a move may have been under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whereabouts {
    /// Where it was last reported, in mm.
    pub from_mm: [f64; 3],
    /// Where it was to go in a straight line, in mm.
    pub to_mm: [f64; 3],
}

impl Whereabouts {
    /// True if a place lies within this distance of the line between the two.
    pub fn holds(&self, place_mm: [f64; 3], tolerance_mm: f64) -> bool {
        let nearest_mm = nearest_on_line_mm(self.from_mm, self.to_mm, place_mm);
        distance_mm(nearest_mm, place_mm) <= tolerance_mm
    }
}

/// Status of the stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// It stands still; its position is not known until it is homed.
    Unhomed,
    /// It stands still.
    Idle,
    /// It moves.
    Moving,
    /// It decelerates, or holds after a stop.
    Hold,
    /// It searches for its reference position.
    Homing,
    /// It accepts no commands until the alarm is cleared.
    Alarm,
}

/// A fault of the controller, to be remedied and cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alarm {
    /// The controller's number; 0 if it did not report one. Where the protocol has two letters, the first is the high
    /// byte: `FS` is 0x4653.
    pub code: u16,
    /// The axis, if the protocol reports it.
    pub axis: Option<AxisName>,
    /// What it means and what to do, in words.
    pub meaning: &'static str,
}

/// Why a command failed.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// [`Session::stop`](super::Session::stop) ended it.
    Stopped {
        /// Position of the stage.
        position_mm: [f64; 3],
    },
    /// [`Session::withhold`](super::Session::withhold) ended it.
    Withheld,
    /// The controller refused the command or did not confirm it, or it is impossible.
    Refused {
        /// What the controller refused, as text for a person.
        command: String,
        /// Why, in words.
        reason: String,
    },
    /// No report or reply came during a motion. The stage was stopped, and stands.
    Unanswered {
        /// The motion's command.
        command: String,
        /// Time without an answer.
        waited: Duration,
    },
    /// The controller is in alarm.
    Alarm(Alarm),
    /// The position is not known.
    Unhomed,
    /// The stage was asked where it stands, and is not idle.
    NotIdle {
        /// Position that the controller reports.
        position_mm: [f64; 3],
    },
    /// Someone else moved an axis meanwhile, by its knob or from another host. The stage was stopped.
    Interrupted {
        /// The axis that was moved.
        axis: AxisName,
        /// What the controller reported, in words.
        meaning: &'static str,
        /// Position of the stage.
        position_mm: [f64; 3],
    },
    /// The stage stands still, but not at the target.
    NotThere {
        /// Target of the move.
        target_mm: [f64; 3],
        /// Position that the controller reports.
        position_mm: [f64; 3],
    },
    /// A report of the move was off its way, or ahead of its speed. The stage was stopped.
    Astray {
        /// Target of the move.
        target_mm: [f64; 3],
        /// Position of the stage.
        position_mm: [f64; 3],
    },
    /// The move took too long. The stage was stopped.
    Overdue {
        /// Target of the move.
        target_mm: [f64; 3],
        /// Position that the controller reports.
        position_mm: [f64; 3],
        /// Time since the move was sent.
        waited: Duration,
    },
}

/// What kind of error ended a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The controller does not answer, or has stopped answering.
    Silent,
    /// The device answers, but does not understand the queries.
    Protocol,
    /// The stage differs from the configuration.
    Mismatch,
}

impl Alarm {
    /// Its short name, such as `1` or `z FS`.
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

    /// The same failure, with the position at which the stage came to rest.
    pub(crate) fn at(self, position_mm: [f64; 3]) -> Self {
        match self {
            Self::Stopped { .. } => Self::Stopped { position_mm },
            Self::Overdue { target_mm, waited, .. } => Self::Overdue { target_mm, position_mm, waited },
            Self::Interrupted { axis, meaning, .. } => Self::Interrupted { axis, meaning, position_mm },
            Self::Withheld
            | Self::Refused { .. }
            | Self::Unanswered { .. }
            | Self::Alarm(_)
            | Self::Unhomed
            | Self::NotIdle { .. } => self,
            Self::NotThere { target_mm, .. } => Self::NotThere { target_mm, position_mm },
            Self::Astray { target_mm, .. } => Self::Astray { target_mm, position_mm },
        }
    }
}
