//! Requests to devices, one at a time.

use core::time::Duration;

use crate::zaber::Flag;

/// An unanswered query or setting is sent again after this. An answer usually takes about 5 ms.
const REPLY_TIMEOUT: Duration = Duration::from_millis(250);

/// After this, it is unknown whether an unanswered move or homing has arrived.
pub(super) const MOTION_REPLY_TIMEOUT: Duration = Duration::from_millis(500);

/// A device that has left a request unanswered for this long is gone.
const SILENCE_MAX: Duration = Duration::from_secs(2);

/// A query, setting or motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Request {
    Checksums,
    Version,
    AxisCount,
    Resolution,
    LimitMin,
    LimitMax,
    Position,
    Warnings,
    Clear,
    Enable,
    Speed(i64),
    Accel(i64),
    Move(i64),
    Home,
}

/// A request to the axis in a slot, or to its device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SlotRequest {
    pub(super) slot: usize,
    pub(super) request: Request,
}

/// The pending request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pending {
    pub(super) request: SlotRequest,
    pub(super) id: u8,
    pub(super) since: Duration,
    pub(super) sent: Duration,
}

/// Data of an answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Answer {
    Done,
    Text(String),
    Number(i64),
    Flags(Vec<Flag>),
}

impl Request {
    /// The command's words.
    pub(super) fn text(self) -> String {
        match self {
            Self::Checksums => "set comm.checksum 1".to_owned(),
            Self::Version => "get version".to_owned(),
            Self::AxisCount => "get system.axiscount".to_owned(),
            Self::Resolution => "get resolution".to_owned(),
            Self::LimitMin => "get limit.min".to_owned(),
            Self::LimitMax => "get limit.max".to_owned(),
            Self::Position => "get pos".to_owned(),
            Self::Warnings => "warnings".to_owned(),
            Self::Clear => "warnings clear".to_owned(),
            Self::Enable => "driver enable".to_owned(),
            Self::Speed(value) => format!("set maxspeed {value}"),
            Self::Accel(value) => format!("set accel {value}"),
            Self::Move(target) => format!("move abs {target}"),
            Self::Home => "home".to_owned(),
        }
    }

    /// True for a request to the device, not to one of its axes.
    pub(super) fn is_of_device(self) -> bool {
        matches!(self, Self::Checksums | Self::Version | Self::AxisCount)
    }

    /// True if it moves an axis: it is then sent only once.
    pub(super) fn moves(self) -> bool {
        matches!(self, Self::Move(_) | Self::Home)
    }

    /// Parses the data of an answer; `None` if they do not fit this request.
    pub(super) fn read(self, data: &str) -> Option<Answer> {
        match self {
            Self::Version => (!data.is_empty() && data.len() <= 16).then(|| Answer::Text(data.to_owned())),
            Self::AxisCount | Self::Resolution | Self::LimitMin | Self::LimitMax | Self::Position => {
                data.parse().ok().map(Answer::Number)
            }
            Self::Warnings => {
                let mut words = data.split_ascii_whitespace();
                let count: usize = words.next()?.parse().ok()?;
                let flags: Vec<_> = words.map(Flag::parse).collect::<Option<_>>()?;
                (flags.len() == count).then_some(Answer::Flags(flags))
            }
            Self::Checksums
            | Self::Clear
            | Self::Enable
            | Self::Speed(_)
            | Self::Accel(_)
            | Self::Move(_)
            | Self::Home => Some(Answer::Done),
        }
    }
}

impl Pending {
    /// When to act on a missing answer.
    pub(super) fn overdue(&self) -> Duration {
        self.sent + if self.request.request.moves() { MOTION_REPLY_TIMEOUT } else { REPLY_TIMEOUT }
    }

    /// True if the device has been silent for too long.
    pub(super) fn is_silent(&self, now: Duration) -> bool {
        now.saturating_sub(self.since) >= SILENCE_MAX
    }
}
