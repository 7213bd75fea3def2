//! What a session asks its driver to do, and what it reports.

use super::Reading;

/// What a session asks for or reports.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Write these bytes.
    Send(Vec<u8>),
    /// Readings follow. Comes just before the first, and again before the first after [`Action::Lost`].
    Connected {
        /// Serial numbers and versions that the device reported; `None` if the protocol has no query for them.
        identity: Option<String>,
    },
    /// A fresh reading.
    Reading(Reading),
    /// Something that a person should know, for the log. Readings continue.
    Warning(String),
    /// Readings have stopped. The session continues and waits for more.
    Lost(Loss),
    /// The session is over: open the link again.
    Failed(Loss),
}

/// Why there are no readings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loss {
    /// What physically happened.
    pub cause: Cause,
    /// What happened and what to do about it, for a person.
    pub what: String,
}

/// What physically happened when readings stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The device sends nothing, or nothing new.
    Silent,
    /// The device restarted: its clock and counters begin again.
    Restarted,
    /// It sends something, but not in this protocol or not for this array.
    Protocol,
    /// It reports a fault of its own.
    DeviceFault,
}

impl Loss {
    pub(crate) fn new(cause: Cause, what: impl Into<String>) -> Self {
        Self { cause, what: what.into() }
    }
}
