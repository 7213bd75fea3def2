//! The phases of a session.

use core::time::Duration;

use super::Failure;
use crate::grbl::active_move::ActiveMove;
use crate::grbl::feed::Feed;

/// Longest deceleration after a hold, before the controller is reset in motion.
const HOLD_TIMEOUT: Duration = Duration::from_secs(3);

/// What the session is doing.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Phase {
    /// Waiting for a banner. The first one may come without a reset.
    Resetting { purpose: Purpose, resets: u32, deadline: Duration },
    /// Waiting for a report that was requested after `since`.
    Looking { purpose: Purpose, since: Duration },
    /// Querying version or settings, for the `tries`th time.
    Asking { query: Query, tries: u32, deadline: Duration },
    /// No command is under way.
    Ready,
    /// A move waits for its feed.
    Preparing(Preparation),
    /// A move is under way.
    Moving(ActiveMove),
    /// Homing; `accepted` is when the controller reported its end.
    Homing { deadline: Duration, accepted: Option<Duration> },
    /// `$X` was sent.
    Unlocking { deadline: Duration },
    /// A feed hold was sent. The command under way will end with `failure`.
    Holding { failure: Option<Failure>, since: Duration },
    /// The session has not started, or has failed.
    Over,
}

/// A query about the controller before it is accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Query {
    /// `$I`: its version.
    Build,
    /// `$$`: its settings.
    Settings,
}

/// Purpose of a reset, or of a request for the position.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Purpose {
    /// To find out whether a controller answers.
    Greet,
    /// None: something else reset the controller.
    Recover,
    /// To clear an alarm.
    Clear,
    /// Nothing is reset: a command needs the stage's position. `reports` is the number of reports so far.
    Look { wanted: Wanted, reports: u32 },
    /// To discard the commands that the controller holds. It stood still at `held_mm`; `None` if it may have been moving.
    Stop { failure: Option<Failure>, held_mm: Option<[f64; 3]> },
}

/// Why a command needs the position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Wanted {
    /// To report it.
    Position,
    /// To check whether it is this one.
    At([f64; 3]),
    /// To move from it.
    Move { target_mm: [f64; 3], speed_mm_per_s: f64 },
}

/// A move whose feed is being set and read back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Preparation {
    pub(super) target_mm: [f64; 3],
    pub(super) speed_mm_per_s: f64,
    pub(super) feed: Feed,
    /// It is being set for this time.
    pub(super) tries: u32,
    /// The controller was asked for its feed, and has reported the right one.
    pub(super) asked: bool,
    pub(super) told: bool,
    pub(super) deadline: Duration,
}

impl Phase {
    /// When the phase has taken too long.
    pub(super) fn deadline(&self) -> Option<Duration> {
        match self {
            Self::Resetting { deadline, .. }
            | Self::Asking { deadline, .. }
            | Self::Homing { deadline, .. }
            | Self::Unlocking { deadline }
            | Self::Preparing(Preparation { deadline, .. }) => Some(*deadline),
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
