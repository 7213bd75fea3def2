//! How far a recorder is behind: what was queued and is not written yet.

use std::collections::VecDeque;
use std::time::Duration;

use tactus_record::Missing;
use tactus_schema::MonoTime;

/// A backlog of this age is an alarm.
pub(super) const ALARM: Duration = Duration::from_millis(500);

/// A backlog of this age fails the run.
pub(super) const AGE_MAX: Duration = Duration::from_secs(1);

/// A backlog of this size fails the run, whatever its age.
pub(super) const BYTES_MAX: u64 = 32 * 1024 * 1024;

/// The messages that were queued and are not written yet. It counts; it has no clock and no queue.
#[derive(Debug, Default)]
pub(super) struct Backlog {
    /// Times, sizes, and whether they are frames, in order.
    waiting: VecDeque<(MonoTime, u64, bool)>,
    written: u64,
    bytes: u64,
    frames: u64,
    alarmed: bool,
}

/// Whether a recorder keeps up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lag {
    KeepsUp,
    /// It has become old: once, until it is worked off.
    Alarm(Duration),
    TooLate(Duration),
}

impl Backlog {
    /// Counts a message that was queued.
    pub(super) fn queued(&mut self, at: MonoTime, bytes: u64, is_frame: bool) {
        self.waiting.push_back((at, bytes, is_frame));
        self.bytes += bytes;
        self.frames += u64::from(is_frame);
    }

    /// Judges the backlog, when `written` messages in all have been written.
    pub(super) fn check(&mut self, written: u64, now: MonoTime) -> Lag {
        self.settle(written);
        let Some(oldest) = self.oldest() else {
            self.alarmed = false;
            return Lag::KeepsUp;
        };
        // Messages are queued a little out of the order of their times: then it is zero.
        let age = now.since(oldest);
        if age > AGE_MAX || self.bytes > BYTES_MAX {
            return Lag::TooLate(age);
        }
        if age < ALARM {
            self.alarmed &= age > ALARM / 2;
            return Lag::KeepsUp;
        }
        if std::mem::replace(&mut self.alarmed, true) { Lag::KeepsUp } else { Lag::Alarm(age) }
    }

    /// Removes what was written.
    pub(super) fn settle(&mut self, written: u64) {
        while self.written < written {
            self.written += 1;
            if let Some((_, bytes, is_frame)) = self.waiting.pop_front() {
                self.bytes -= bytes;
                self.frames -= u64::from(is_frame);
            }
        }
    }

    /// Time of the oldest message that waits.
    pub(super) fn oldest(&self) -> Option<MonoTime> {
        self.waiting.front().map(|(at, ..)| *at)
    }

    /// Number of messages that wait.
    pub(super) fn messages(&self) -> u64 {
        self.waiting.len() as u64
    }

    /// Number of frames that wait.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// What waits.
    pub(super) fn waiting(&self) -> Missing {
        Missing { messages: self.messages(), frames: self.frames, ..Missing::default() }
    }

    /// Size of the messages that wait.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }
}

#[cfg(test)]
#[path = "backlog_tests.rs"]
mod tests;
