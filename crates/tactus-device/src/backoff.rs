//! Pauses between attempts to reach a device.

use std::time::Duration;

const FIRST: Duration = Duration::from_millis(20);

/// A device that has come back is found within this.
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

    /// The next pause.
    pub(crate) fn pause(&mut self) -> Duration {
        let pause = self.next;
        self.next = (pause * 2).min(LONGEST);
        pause
    }

    /// Begins again with short pauses: the device answered.
    pub(crate) fn reset(&mut self) {
        *self = Self::new();
    }
}
