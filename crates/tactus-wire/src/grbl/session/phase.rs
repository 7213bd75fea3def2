//! What a session is about.

use core::time::Duration;

use super::Failure;
use crate::grbl::active_move::ActiveMove;

/// How long a held stage may go on decelerating before it is reset in motion.
const HOLD_TIMEOUT: Duration = Duration::from_secs(3);

/// What a session is about.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Phase {
    /// A banner is waited for, at first perhaps without a reset.
    Resetting { purpose: Purpose, resets: u32, deadline: Duration },
    /// The first report asked for since then is waited for.
    Looking { purpose: Purpose, since: Duration },
    /// The controller is asked what it is, for the `tries`th time.
    Asking { query: Query, tries: u32, deadline: Duration },
    /// Nothing is in hand.
    Ready,
    /// A move is in hand.
    Moving(ActiveMove),
    /// Homing is in hand; `accepted` is when the controller said that it is done.
    Homing { deadline: Duration, accepted: Option<Duration> },
    /// `$X` is on its way.
    Unlocking { deadline: Duration },
    /// A feed hold was sent; the command in hand will end with `failure`.
    Holding { failure: Option<Failure>, since: Duration },
    /// It has not started, or has failed.
    Over,
}

/// What the controller is asked before it is taken for the rig's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Query {
    /// `$I`: its version.
    Build,
    /// `$$`: its settings.
    Settings,
}

/// What a reset is for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Purpose {
    /// To see whether there is a controller.
    Greet,
    /// None: it was not ours.
    Recover,
    /// To clear an alarm.
    Clear,
    /// To flush what the controller still holds, while it stands at `held_mm`; `None` if it may have been moving.
    Stop { failure: Option<Failure>, held_mm: Option<[f64; 3]> },
}

impl Phase {
    /// When it has taken too long.
    pub(super) fn deadline(&self) -> Option<Duration> {
        match self {
            Self::Resetting { deadline, .. }
            | Self::Asking { deadline, .. }
            | Self::Homing { deadline, .. }
            | Self::Unlocking { deadline } => Some(*deadline),
            Self::Moving(travel) => Some(travel.arrival().overdue()),
            Self::Holding { since, .. } => Some(*since + HOLD_TIMEOUT),
            Self::Looking { .. } | Self::Ready | Self::Over => None,
        }
    }
}

impl Query {
    /// The line to send, without its end.
    pub(super) fn line(self) -> &'static str {
        match self {
            Self::Build => "$I",
            Self::Settings => "$$",
        }
    }
}
