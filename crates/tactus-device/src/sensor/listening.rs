//! How long a device that streams by itself may be listened to without a fresh frame.

use std::time::Duration;

/// A stream that is silent for this long is lost.
pub(super) const SILENT_AFTER: Duration = Duration::from_secs(1);

/// A stream in which there is no frame for this long is another device's.
pub(super) const NO_FRAME_AFTER: Duration = Duration::from_secs(2);

/// Times of what was heard.
#[derive(Debug, Clone, Default)]
pub(super) struct Listening {
    /// The last fresh frame, or when its absence was told.
    since: Duration,
    last_bytes: Option<Duration>,
    stale_since: u64,
    due: Option<Duration>,
    flows: bool,
}

/// What is heard in place of fresh frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// Nothing, for [`SILENT_AFTER`].
    Nothing,
    /// The same frame again and again, for [`SILENT_AFTER`].
    NothingNew,
    /// Bytes, but no frame for [`NO_FRAME_AFTER`].
    NoFrame,
}

impl Listening {
    /// The connection is open.
    pub(super) fn start(&mut self, now: Duration) {
        self.begin(now);
    }

    /// When [`timer`](Self::timer) is due.
    pub(super) fn deadline(&self) -> Option<Duration> {
        self.due
    }

    /// Bytes came.
    pub(super) fn bytes(&mut self, now: Duration) {
        self.last_bytes = Some(now);
    }

    /// A frame came that holds nothing new.
    pub(super) fn stale_frame(&mut self) {
        self.stale_since += 1;
    }

    /// A fresh frame came; true if it is the first, or the first after a loss.
    pub(super) fn fresh_frame(&mut self, now: Duration) -> bool {
        self.begin(now);
        !std::mem::replace(&mut self.flows, true)
    }

    /// What is to be told at the deadline; once, and again after as long a time.
    pub(super) fn timer(&mut self, now: Duration) -> Option<Heard> {
        self.due.filter(|due| now >= *due)?;
        let silent_at = self.last_bytes.map_or(self.since, |last| last.max(self.since)) + SILENT_AFTER;
        let no_frame_at = self.since + NO_FRAME_AFTER;
        let heard = if self.stale_since > 0 {
            Heard::NothingNew
        } else if now >= silent_at {
            Heard::Nothing
        } else if now >= no_frame_at {
            Heard::NoFrame
        } else {
            self.due = Some(silent_at.min(no_frame_at));
            return None;
        };
        self.flows = false;
        self.begin(now);
        Some(heard)
    }

    fn begin(&mut self, now: Duration) {
        self.since = now;
        self.stale_since = 0;
        self.due = Some(now + SILENT_AFTER);
    }
}
