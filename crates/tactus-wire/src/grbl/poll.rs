//! Schedules requests for status reports.

use core::time::Duration;
use std::collections::VecDeque;

/// Reports that have not arrived after a pause of this length, in which nothing is asked, are lost.
const PAUSE: Duration = Duration::from_millis(500);

/// Queries that can be outstanding. A later one is not noted: its report then counts as an answer to an older one.
const OUTSTANDING_MAX: usize = 64;

/// A link without any report for this long is dead.
const SILENCE_MAX: Duration = Duration::from_secs(2);

/// Requests status reports, one at a time.
///
/// A report has no number. It counts as the answer to the oldest query that has none, so that it is never believed to be
/// younger than it is. A report that is lost makes all later ones seem older than they are, which costs a look a query more.
/// At rest a pause tells lost reports from late ones.
#[derive(Debug, Clone, Default)]
pub(super) struct StatusPoll {
    /// When the last query was sent.
    last: Option<Duration>,
    /// When the first query since the last report was sent.
    waiting: Option<Duration>,
    /// When the queries were sent whose reports have not arrived, the oldest first.
    sent: VecDeque<Duration>,
    /// When the last report arrived.
    reported: Option<Duration>,
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

    /// The interval of a stage at rest: longer if a report is missing, until it is known to be lost.
    pub(super) fn interval_at_rest(&self, interval: Duration) -> Duration {
        let pause = match (self.last, self.reported) {
            (Some(last), Some(reported)) if !self.sent.is_empty() => (reported + PAUSE).saturating_sub(last),
            _ => Duration::ZERO,
        };
        interval.max(pause)
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
        let has_paused = self.reported.is_some_and(|reported| now.saturating_sub(reported) >= PAUSE);
        if self.waiting.is_none() && has_paused {
            self.sent.clear();
        }
        self.last = Some(now);
        self.waiting.get_or_insert(now);
        if self.sent.len() < OUTSTANDING_MAX {
            self.sent.push_back(now);
        }
        self.at_once = false;
    }

    /// Notes that a report arrived. Returns the earliest time at which it was requested; `None` if it was not.
    pub(super) fn answered(&mut self, now: Duration) -> Option<Duration> {
        self.waiting = None;
        self.reported = Some(now);
        self.sent.pop_front()
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
