//! Schedules requests for status reports.

use core::time::Duration;
use std::collections::VecDeque;

/// A report that is later than this is lost.
const LATE_MAX: Duration = Duration::from_millis(300);

/// A link without any report for this long is dead.
const SILENCE_MAX: Duration = Duration::from_secs(2);

/// Requests status reports, one at a time.
#[derive(Debug, Clone, Default)]
pub(super) struct StatusPoll {
    /// When the last query was sent.
    last: Option<Duration>,
    /// When the first query since the last report was sent.
    waiting: Option<Duration>,
    /// When the queries were sent whose reports have not arrived, late ones included. At most one in 20 ms for this long.
    sent: VecDeque<Duration>,
    /// The next query does not wait for the interval.
    at_once: bool,
}

impl StatusPoll {
    /// When to send the next query, at this interval, or after this time without an answer.
    pub(super) fn next(&self, interval: Duration, timeout: Duration) -> Duration {
        match (self.last, self.waiting) {
            (Some(last), Some(_)) => last + timeout,
            (Some(last), None) if !self.at_once => last + interval,
            _ => Duration::ZERO,
        }
    }

    /// Sends the next query as soon as none is unanswered.
    pub(super) fn at_once(&mut self) {
        self.at_once = true;
    }

    /// Counts the interval from now on.
    pub(super) fn defer(&mut self, now: Duration) {
        if self.waiting.is_none() {
            self.last = Some(now);
        }
    }

    /// Notes that a query is sent now.
    pub(super) fn sent(&mut self, now: Duration) {
        self.last = Some(now);
        self.waiting.get_or_insert(now);
        self.sent.push_back(now);
        self.forget_lost(now);
        self.at_once = false;
    }

    /// Notes that a report arrived. Returns the earliest time at which it was requested; `None` if it was not.
    pub(super) fn answered(&mut self, now: Duration) -> Option<Duration> {
        self.waiting = None;
        self.forget_lost(now);
        self.sent.pop_front()
    }

    fn forget_lost(&mut self, now: Duration) {
        while self.sent.pop_front_if(|sent| now.saturating_sub(*sent) > LATE_MAX).is_some() {}
    }

    /// True if the last query repeats an unanswered one.
    pub(super) fn is_repeated(&self) -> bool {
        self.waiting.is_some() && self.waiting != self.last
    }

    /// Forgets a query that was lost by a reset.
    pub(super) fn reset(&mut self) {
        *self = Self::default();
    }

    /// Since when a query has been unanswered.
    pub(super) fn unanswered(&self) -> Option<Duration> {
        self.waiting
    }

    /// True if queries have been unanswered for too long.
    pub(super) fn is_silent(&self, now: Duration) -> bool {
        self.waiting.is_some_and(|since| now.saturating_sub(since) >= SILENCE_MAX)
    }
}
