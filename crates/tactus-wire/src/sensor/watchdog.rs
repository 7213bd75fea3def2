//! Detects that a device which streams by itself sends no fresh frames any more.

use core::time::Duration;

/// A stream without bytes, or with nothing new in its frames, is lost after this.
pub(crate) const SILENT_AFTER: Duration = Duration::from_secs(1);

/// A stream of bytes without a frame for this long comes from another device.
pub(crate) const NO_FRAME_AFTER: Duration = Duration::from_secs(2);

/// Times of the last bytes and of the last fresh frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Watchdog {
    /// Time of the last fresh frame, or of the last fault.
    since: Duration,
    last_bytes: Option<Duration>,
    /// Stale frames after `since`.
    stale_since: u64,
    due: Option<Duration>,
    flows: bool,
}

/// What came instead of fresh frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StreamFault {
    /// Nothing, for [`SILENT_AFTER`].
    Silent,
    /// The same frame again and again, for [`SILENT_AFTER`].
    Stale,
    /// Bytes, but no frame for [`NO_FRAME_AFTER`].
    NoFrame,
}

impl Watchdog {
    /// The connection is open.
    pub(crate) fn start(&mut self, now: Duration) {
        self.begin(now);
    }

    /// When [`timer`](Self::timer) is due.
    pub(crate) fn deadline(&self) -> Option<Duration> {
        self.due
    }

    /// Bytes came.
    pub(crate) fn bytes(&mut self, now: Duration) {
        self.last_bytes = Some(now);
    }

    /// A frame came that holds nothing new.
    pub(crate) fn stale_frame(&mut self) {
        self.stale_since += 1;
    }

    /// A fresh frame came; true if it is the first, or the first after a fault.
    pub(crate) fn fresh_frame(&mut self, now: Duration) -> bool {
        self.begin(now);
        !core::mem::replace(&mut self.flows, true)
    }

    /// The fault at the deadline, if there is one. A fault that lasts is reported again after as long a time.
    pub(crate) fn timer(&mut self, now: Duration) -> Option<StreamFault> {
        self.due.filter(|due| now >= *due)?;
        let silent_at = self.last_bytes.map_or(self.since, |last| last.max(self.since)) + SILENT_AFTER;
        let no_frame_at = self.since + NO_FRAME_AFTER;
        let fault = if self.stale_since > 0 {
            StreamFault::Stale
        } else if now >= silent_at {
            StreamFault::Silent
        } else if now >= no_frame_at {
            StreamFault::NoFrame
        } else {
            self.due = Some(silent_at.min(no_frame_at));
            return None;
        };
        self.flows = false;
        self.begin(now);
        Some(fault)
    }

    fn begin(&mut self, now: Duration) {
        self.since = now;
        self.stale_since = 0;
        self.due = Some(now + SILENT_AFTER);
    }
}
