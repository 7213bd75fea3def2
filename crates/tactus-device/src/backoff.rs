//! Pauses between attempts to reach a device.

use std::time::Duration;

const FIRST: Duration = Duration::from_millis(20);

/// The longest pause: a device that is back is found within this time.
const LONGEST: Duration = Duration::from_secs(1);

/// Pauses that double from 20 ms to 1 s.
#[derive(Debug, Clone)]
pub(crate) struct Backoff {
    next: Duration,
}

impl Backoff {
    pub(crate) fn new() -> Self {
        Self { next: FIRST }
    }

    /// The next pause; the one after it is twice as long.
    pub(crate) fn pause(&mut self) -> Duration {
        let pause = self.next;
        self.next = (pause * 2).min(LONGEST);
        pause
    }

    /// Starts again with short pauses, because the device answered.
    pub(crate) fn reset(&mut self) {
        *self = Self::new();
    }
}
