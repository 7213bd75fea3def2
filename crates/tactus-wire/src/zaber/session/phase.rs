//! What a session is about.

use core::time::Duration;

use super::Failure;
use crate::stage::ArrivalCheck;

/// A stop that a device has not confirmed by then is sent again.
const STOP_REPLY_TIMEOUT: Duration = Duration::from_millis(250);

/// How long a stopped stage may go on decelerating before it is stopped harder, and then before it is given
/// up.
const DECELERATION_MAX: Duration = Duration::from_secs(3);

/// What a session is about.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Phase {
    /// The devices are asked what they are.
    Greeting,
    /// Nothing is in hand.
    Ready,
    /// A move is in hand.
    Moving(ActiveMove),
    /// Homing is in hand: of the axes in the slots of `group`, and `then` of the others.
    Homing { group: Vec<usize>, then: Option<Vec<usize>>, deadline: Duration },
    /// An alarm is being cleared.
    Clearing,
    /// A stop was sent.
    Stopping(Stop),
    /// It has not started, or has failed.
    Over,
}

/// A move under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ActiveMove {
    pub(super) command: String,
    /// In whole microsteps.
    pub(super) arrival: ArrivalCheck,
    /// Every axis has confirmed its move.
    pub(super) set_out: bool,
}

/// A stop under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stop {
    /// How the command in hand will end.
    pub(super) failure: Option<Failure>,
    pub(super) since: Duration,
    /// When it was last sent, and with which id.
    pub(super) sent: Duration,
    pub(super) id: u8,
    /// Devices that have not confirmed it, and since when the first is waited for.
    pub(super) unheard: Vec<u8>,
    pub(super) unheard_since: Duration,
    /// It is an emergency stop by now.
    pub(super) is_hard: bool,
}

impl Phase {
    /// When something is to be done about it.
    pub(super) fn deadline(&self) -> Option<Duration> {
        match self {
            Self::Moving(travel) => Some(travel.arrival.overdue()),
            Self::Homing { deadline, .. } => Some(*deadline),
            Self::Stopping(stop) => Some(stop.deadline()),
            Self::Greeting | Self::Ready | Self::Clearing | Self::Over => None,
        }
    }
}

impl Stop {
    /// The command that is to be sent.
    pub(super) fn text(&self) -> &'static str {
        if self.is_hard { "estop" } else { "stop" }
    }

    /// When the stage should stand.
    pub(super) fn too_long(&self) -> Duration {
        self.since + DECELERATION_MAX * if self.is_hard { 2 } else { 1 }
    }

    fn deadline(&self) -> Duration {
        let too_long = self.too_long();
        if self.unheard.is_empty() { too_long } else { too_long.min(self.sent + STOP_REPLY_TIMEOUT) }
    }
}
