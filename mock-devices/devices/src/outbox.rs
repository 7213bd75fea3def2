//! Bytes that a device will send, each at its time.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;

/// A queue of bytes with the instants at which they leave; their order never changes.
///
/// Due bytes leave whether or not a host listens, so the rate of its producers bounds its length.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    chunks: VecDeque<(Instant, Vec<u8>)>,
}

impl Outbox {
    /// Schedules bytes for `due`, or for the time of the last scheduled byte if that is later.
    pub(crate) fn push(&mut self, due: Instant, bytes: impl Into<Vec<u8>>) {
        let bytes = bytes.into();
        if !bytes.is_empty() {
            let due = self.chunks.back().map_or(due, |(last, _)| due.max(*last));
            self.chunks.push_back((due, bytes));
        }
    }

    /// Schedules bytes one at a time, evenly over `duration` from `from` on.
    pub(crate) fn drip(&mut self, from: Instant, duration: Duration, bytes: &[u8]) {
        let pause = duration / u32::try_from(bytes.len().max(1)).unwrap_or(u32::MAX);
        let mut due = from;
        for byte in bytes {
            self.push(due, [*byte]);
            due += pause;
        }
    }

    /// When the next bytes leave.
    pub(crate) fn next_due(&self) -> Option<Instant> {
        self.chunks.front().map(|(due, _)| *due)
    }

    /// Takes the bytes that leave by `now`.
    pub(crate) fn take_due(&mut self, now: Instant) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some((_, chunk)) = self.chunks.pop_front_if(|(due, _)| *due <= now) {
            bytes.extend(chunk);
        }
        bytes
    }

    /// Discards bytes that have not left.
    pub(crate) fn clear(&mut self) {
        self.chunks.clear();
    }
}

#[cfg(test)]
#[path = "outbox_tests.rs"]
mod tests;
