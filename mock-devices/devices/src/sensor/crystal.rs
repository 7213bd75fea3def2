//! The oscillator of a device: its time as a function of the host's.

use std::time::Duration;

use tokio::time::Instant;

/// A clock that may run fast or slow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crystal {
    /// When it had run for [`Self::had_run`].
    since: Instant,
    had_run: Duration,
    /// Its seconds per second of the host.
    rate: f64,
}

impl Crystal {
    /// Starts now, without drift.
    pub(super) fn started(now: Instant) -> Self {
        Self { since: now, had_run: Duration::ZERO, rate: 1.0 }
    }

    /// Lets it run fast by this many millionths from now on; slow if they are negative.
    pub(super) fn drift(&mut self, ppm: f64, now: Instant) {
        *self = Self { since: now, had_run: self.running(now), rate: 1.0 + ppm * 1e-6 };
    }

    /// How long it has run, by itself.
    pub(super) fn running(self, now: Instant) -> Duration {
        self.had_run + now.saturating_duration_since(self.since).mul_f64(self.rate)
    }

    /// When it will have run for so long.
    pub(super) fn instant(self, running: Duration) -> Instant {
        self.since + running.saturating_sub(self.had_run).div_f64(self.rate)
    }
}
