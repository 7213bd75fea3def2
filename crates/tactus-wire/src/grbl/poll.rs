//! Schedules requests for status reports.

use core::time::Duration;

/// A report that has not arrived after this is requested again. It usually takes 5-60 ms.
const REPORT_TIMEOUT: Duration = Duration::from_millis(250);

/// A link without any report for this long is dead.
const SILENCE_MAX: Duration = Duration::from_secs(2);

/// Requests status reports, one at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct StatusPoll {
    /// When the last query was sent.
    last: Option<Duration>,
    /// When the first of the unanswered queries was sent.
    waiting: Option<Duration>,
    /// The next query does not wait for the interval.
    at_once: bool,
}

impl StatusPoll {
    /// When to send the next query, at this interval.
    pub(super) fn next(&self, interval: Duration) -> Duration {
        match (self.last, self.waiting) {
            (Some(last), Some(_)) => last + REPORT_TIMEOUT,
            (Some(last), None) if !self.at_once => last + interval,
            _ => Duration::ZERO,
        }
    }

    /// Sends the next query as soon as none is unanswered.
    pub(super) fn at_once(&mut self) {
        self.at_once = true;
    }

    /// Notes that a query is sent now.
    pub(super) fn sent(&mut self, now: Duration) {
        self.last = Some(now);
        self.waiting.get_or_insert(now);
        self.at_once = false;
    }

    /// Notes that a report arrived. Returns the earliest time at which it was requested; `None` if it was not.
    pub(super) fn answered(&mut self) -> Option<Duration> {
        self.waiting.take()
    }

    /// True if the last query repeats an unanswered one.
    pub(super) fn is_repeated(&self) -> bool {
        self.waiting.is_some() && self.waiting != self.last
    }

    /// Forgets a query that was lost by a reset.
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }

    /// True if queries have been unanswered for too long.
    pub(super) fn is_silent(&self, now: Duration) -> bool {
        self.waiting.is_some_and(|since| now.saturating_sub(since) >= SILENCE_MAX)
    }
}
