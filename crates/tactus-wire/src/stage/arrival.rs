//! Whether a move has arrived: how long it may take, and what a report proves.

use core::time::Duration;

use super::distance_mm;

/// What a move may take beyond twice the time that it should.
const ALLOWANCE: Duration = Duration::from_secs(2);

/// For how long the controller must say that it stands elsewhere, before that is believed: it may not have set out
/// yet.
const ELSEWHERE_MIN: Duration = Duration::from_millis(200);

/// A place that is to be reached.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ArrivalCheck {
    target_mm: [f64; 3],
    sent: Duration,
    overdue: Duration,
    /// Since when the controller says that it stands elsewhere.
    elsewhere: Option<Duration>,
}

/// What a report means for a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Judgement {
    /// Go on waiting.
    Underway,
    /// Arrived.
    Done,
    /// Standing, but not there.
    NotThere,
}

impl ArrivalCheck {
    /// At a place for which the stage sets out now, and which it should reach within `expected_s`.
    pub(crate) fn new(now: Duration, target_mm: [f64; 3], expected_s: f64) -> Self {
        let expected = Duration::try_from_secs_f64(2.0 * expected_s).unwrap_or(Duration::MAX);
        let overdue = now.saturating_add(expected).saturating_add(ALLOWANCE);
        Self { target_mm, sent: now, overdue, elsewhere: None }
    }

    pub(crate) fn target_mm(&self) -> [f64; 3] {
        self.target_mm
    }

    /// When it is not reached by then, something is wrong.
    pub(crate) fn overdue(&self) -> Duration {
        self.overdue
    }

    pub(crate) fn waited(&self, now: Duration) -> Duration {
        now.saturating_sub(self.sent)
    }

    /// Judges a report: whether the controller stands, and where. Only one that was asked for after the controller
    /// took the move may say that it stands.
    pub(crate) fn judge(
        &mut self,
        now: Duration,
        stands: bool,
        position_mm: [f64; 3],
        tolerance_mm: f64,
    ) -> Judgement {
        if !stands {
            self.elsewhere = None;
            return Judgement::Underway;
        }
        if distance_mm(position_mm, self.target_mm) <= tolerance_mm {
            return Judgement::Done;
        }
        let since = *self.elsewhere.get_or_insert(now);
        if now.saturating_sub(since) >= ELSEWHERE_MIN { Judgement::NotThere } else { Judgement::Underway }
    }
}

#[cfg(test)]
#[path = "arrival_tests.rs"]
mod tests;
