//! Bytes that a device will have sent, each at its time.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;

/// A queue of bytes with the instants at which they leave; none overtakes another.
///
/// It is emptied as its times come, whether or not anybody listens, so that what fills it bounds it.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    chunks: VecDeque<(Instant, Vec<u8>)>,
}

impl Outbox {
    /// Has bytes leave at `due`, or behind what leaves later than that.
    pub(crate) fn push(&mut self, due: Instant, bytes: impl Into<Vec<u8>>) {
        let bytes = bytes.into();
        if !bytes.is_empty() {
            let due = self.chunks.back().map_or(due, |(last, _)| due.max(*last));
            self.chunks.push_back((due, bytes));
        }
    }

    /// Has bytes leave one at a time, evenly over `duration` from `from` on.
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

    /// The bytes that leave by `now`.
    pub(crate) fn take_due(&mut self, now: Instant) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some((_, chunk)) = self.chunks.pop_front_if(|(due, _)| *due <= now) {
            bytes.extend(chunk);
        }
        bytes
    }

    /// Forgets what has not left.
    pub(crate) fn clear(&mut self) {
        self.chunks.clear();
    }
}

#[cfg(test)]
#[path = "outbox_tests.rs"]
mod tests;
