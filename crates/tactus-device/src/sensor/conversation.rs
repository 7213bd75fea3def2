//! What is said and heard over one connection, whatever the protocol: bytes and times in, actions out.

use std::time::Duration;

use tactus_schema::DeviceTick;

use crate::ErrorKind;

/// The host's side of a protocol over one connection.
///
/// [`start`](Self::start) is called once, [`receive`](Self::receive) with what arrives and [`timer`](Self::timer)
/// when [`deadline`](Self::deadline) has come; actions are done in their order. Times never go back.
pub(super) trait Conversation: Send {
    /// Begins.
    fn start(&mut self, now: Duration) -> Vec<Action>;

    /// Takes what one read gave.
    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action>;

    /// Does what is due.
    fn timer(&mut self, now: Duration) -> Vec<Action>;

    /// When [`timer`](Self::timer) is due.
    fn deadline(&self) -> Option<Duration>;

    /// What it met beside good frames, for the log.
    fn quality(&self) -> String;
}

/// What a conversation wants done, or tells.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Action {
    /// Write these bytes.
    Send(Vec<u8>),
    /// Readings flow from here on; comes just before the first, and again before the first after [`Action::Lost`].
    Connected,
    /// A fresh reading.
    Reading(Reading),
    /// Readings have ceased; the conversation goes on and waits for more.
    Lost(Loss),
    /// The conversation is over: the link is to be opened anew.
    Failed(Loss),
}

/// One reading of all elements.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reading {
    /// The device's clock at the sampling, unwrapped, if it has one.
    pub(super) tick: Option<DeviceTick>,
    /// The ticks of earlier readings are from another clock.
    pub(super) new_clock: bool,
    /// What tells how many readings are missing before it.
    pub(super) before: Before,
    /// Row-major, one for each element; those of [`bad`](Self::bad) mean nothing.
    pub(super) counts: Vec<f32>,
    /// Elements that were not read, in order.
    pub(super) bad: Vec<u32>,
}

/// What is known of the way from the reading before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Before {
    /// Only times tell.
    Times,
    /// Bytes came that were no frame: if times say that readings are missing, they are.
    Damage,
    /// The device counts its frames, and says that so many are missing.
    Numbers {
        /// How many, but for whole rounds of the count.
        lost: u64,
        /// After how many frames the count is 0 again.
        wrap: u64,
    },
}

/// Why there are no readings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Loss {
    /// What physically happened.
    pub(super) kind: ErrorKind,
    /// What happened and what to do about it.
    pub(super) what: String,
    /// The device began anew: what follows is a new epoch.
    pub(super) restarted: bool,
}

impl Loss {
    pub(super) fn new(kind: ErrorKind, what: impl Into<String>) -> Self {
        Self { kind, what: what.into(), restarted: false }
    }
}
