//! Decides whether a move has arrived, and whether it takes too long.

use core::time::Duration;

use super::distance_mm;

/// Time that a move may take beyond twice its expected duration.
const ALLOWANCE: Duration = Duration::from_secs(2);

/// How long the controller must report that it stands away from the target before the move counts as failed: it may not
/// have started yet.
const ELSEWHERE_MIN: Duration = Duration::from_millis(200);

/// The target of a move, and when it should be reached.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ArrivalCheck {
    target_mm: [f64; 3],
    sent: Duration,
    overdue: Duration,
    /// Since when the controller reports that it stands away from the target.
    elsewhere: Option<Duration>,
}

/// What a report shows about a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Judgement {
    /// Not decided yet.
    Underway,
    /// Arrived.
    Done,
    /// Standing still away from the target.
    NotThere,
}

impl ArrivalCheck {
    /// A move that starts now and should take `expected_s`.
    pub(crate) fn new(now: Duration, target_mm: [f64; 3], expected_s: f64) -> Self {
        let expected = Duration::try_from_secs_f64(2.0 * expected_s).unwrap_or(Duration::MAX);
        let overdue = now.saturating_add(expected).saturating_add(ALLOWANCE);
        Self { target_mm, sent: now, overdue, elsewhere: None }
    }

    pub(crate) fn target_mm(&self) -> [f64; 3] {
        self.target_mm
    }

    /// A move that has not arrived by then has failed.
    pub(crate) fn overdue(&self) -> Duration {
        self.overdue
    }

    pub(crate) fn waited(&self, now: Duration) -> Duration {
        now.saturating_sub(self.sent)
    }

    /// Judges a report. `stands` may be true only for a report that was requested after the controller accepted the
    /// move.
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
