//! The phases of a session.

use core::time::Duration;

use super::Failure;
use crate::stage::{ArrivalCheck, Course};

/// A stop that a device has not confirmed after this is sent again.
const STOP_REPLY_TIMEOUT: Duration = Duration::from_millis(250);

/// Longest deceleration after a stop before an emergency stop follows, and after that before the session stops waiting.
const DECELERATION_MAX: Duration = Duration::from_secs(3);

/// What the session is doing.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Phase {
    /// Querying the devices.
    Greeting,
    /// No command is under way.
    Ready,
    /// A move is under way.
    Moving(ActiveMove),
    /// Homing the axes in the slots of `group`, then those of `then`.
    Homing { group: Vec<usize>, then: Option<Vec<usize>>, deadline: Duration },
    /// Clearing an alarm.
    Clearing,
    /// A round of queries answers where the stage stands; with a target it must stand there.
    Looking { target_mm: Option<[f64; 3]> },
    /// A stop was sent.
    Stopping(Stop),
    /// The session has not started, or has failed.
    Over,
}

/// A move under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ActiveMove {
    pub(super) command: String,
    /// In whole microsteps.
    pub(super) arrival: ArrivalCheck,
    pub(super) course: Course,
    /// Every axis has confirmed its move.
    pub(super) set_out: bool,
}

/// A stop under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stop {
    /// The result of the command under way; `None` if there is none.
    pub(super) failure: Option<Failure>,
    pub(super) since: Duration,
    /// When it was last sent; `id` is that message's.
    pub(super) sent: Duration,
    pub(super) id: u8,
    /// Devices that have not confirmed it; `unheard_since` is when waiting for them began.
    pub(super) unheard: Vec<u8>,
    pub(super) unheard_since: Duration,
    /// True once it is an emergency stop.
    pub(super) is_hard: bool,
}

impl Phase {
    /// When the phase has taken too long.
    pub(super) fn deadline(&self) -> Option<Duration> {
        match self {
            Self::Moving(travel) => Some(travel.arrival.overdue()),
            Self::Homing { deadline, .. } => Some(*deadline),
            Self::Stopping(stop) => Some(stop.deadline()),
            Self::Greeting | Self::Ready | Self::Clearing | Self::Looking { .. } | Self::Over => None,
        }
    }
}

impl Stop {
    /// The command to send.
    pub(super) fn text(&self) -> &'static str {
        if self.is_hard { "estop" } else { "stop" }
    }

    /// When the stage should stand still.
    pub(super) fn too_long(&self) -> Duration {
        self.since + DECELERATION_MAX * if self.is_hard { 2 } else { 1 }
    }

    fn deadline(&self) -> Duration {
        let too_long = self.too_long();
        if self.unheard.is_empty() { too_long } else { too_long.min(self.sent + STOP_REPLY_TIMEOUT) }
    }
}
