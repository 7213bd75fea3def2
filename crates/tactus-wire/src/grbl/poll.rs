//! When to ask for a status report.

use core::time::Duration;

/// A report that has not come after this is asked for again; it comes after 5-60 ms.
const REPORT_TIMEOUT: Duration = Duration::from_millis(250);

/// Without any report for this long the link is dead.
const SILENCE_MAX: Duration = Duration::from_secs(2);

/// Asks for status reports, one at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct StatusPoll {
    /// When the last query was sent.
    last: Option<Duration>,
    /// When the first of the questions that stand unanswered was sent.
    waiting: Option<Duration>,
    /// The next query does not wait for its turn.
    at_once: bool,
}

impl StatusPoll {
    /// When to ask next, if questions are `interval` apart.
    pub(super) fn next(&self, interval: Duration) -> Duration {
        match (self.last, self.waiting) {
            (Some(last), Some(_)) => last + REPORT_TIMEOUT,
            (Some(last), None) if !self.at_once => last + interval,
            _ => Duration::ZERO,
        }
    }

    /// Asks as soon as no query stands unanswered.
    pub(super) fn at_once(&mut self) {
        self.at_once = true;
    }

    /// A query goes out now.
    pub(super) fn sent(&mut self, now: Duration) {
        self.last = Some(now);
        self.waiting.get_or_insert(now);
        self.at_once = false;
    }

    /// A report has come. Gives when it was asked for at the earliest; `None` if it was not asked for.
    pub(super) fn answered(&mut self) -> Option<Duration> {
        self.waiting.take()
    }

    /// True if the last query was asked again for lack of an answer.
    pub(super) fn is_repeated(&self) -> bool {
        self.waiting.is_some() && self.waiting != self.last
    }

    /// Forgets a query that a reset has swallowed.
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }

    /// True if no report has come for too long.
    pub(super) fn is_silent(&self, now: Duration) -> bool {
        self.waiting.is_some_and(|since| now.saturating_sub(since) >= SILENCE_MAX)
    }
}
