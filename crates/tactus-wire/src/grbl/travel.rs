//! One straight move: how long it may take, and when it is done.

use core::time::Duration;

/// What a move may take beyond twice its length over its speed.
const ALLOWANCE: Duration = Duration::from_secs(2);

/// For how long the controller must say that it stands elsewhere, before that is believed: right after `ok`
/// it may not have set out yet.
const ELSEWHERE_MIN: Duration = Duration::from_millis(200);

/// A move under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Travel {
    target_mm: [f64; 3],
    line: String,
    sent: Duration,
    /// When this is not done by then, something is wrong.
    pub(super) overdue: Duration,
    /// When the controller took the line.
    accepted: Option<Duration>,
    /// Since when the controller says that it stands elsewhere.
    elsewhere: Option<Duration>,
}

/// What a report means for a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Judgement {
    /// Go on waiting.
    Underway,
    /// Arrived.
    Done,
    /// Standing, but not there.
    NotThere,
}

impl Travel {
    /// A move that sets out now. The target is rounded to the three decimals that are sent.
    pub(super) fn new(now: Duration, from_mm: [f64; 3], target_mm: [f64; 3], speed_mm_per_s: f64) -> Self {
        let target_mm = target_mm.map(round_to_um);
        let [x, y, z] = target_mm;
        let line = format!("G90 G21 G1 X{x:.3} Y{y:.3} Z{z:.3} F{:.3}", speed_mm_per_s * 60.0);
        let expected_s = 2.0 * distance_mm(from_mm, target_mm) / speed_mm_per_s;
        let expected = Duration::try_from_secs_f64(expected_s).unwrap_or(Duration::MAX);
        let overdue = now.saturating_add(expected).saturating_add(ALLOWANCE);
        Self { target_mm, line, sent: now, overdue, accepted: None, elsewhere: None }
    }

    /// The line to send, without its end.
    pub(super) fn line(&self) -> &str {
        &self.line
    }

    pub(super) fn target_mm(&self) -> [f64; 3] {
        self.target_mm
    }

    pub(super) fn waited(&self, now: Duration) -> Duration {
        now.saturating_sub(self.sent)
    }

    /// True if the line has not been taken yet.
    pub(super) fn awaits_ok(&self) -> bool {
        self.accepted.is_none()
    }

    pub(super) fn accept(&mut self, now: Duration) {
        self.accepted = Some(now);
    }

    /// Judges a report received now: whether the controller stands, where, and since when it was asked.
    pub(super) fn judge(
        &mut self,
        now: Duration,
        asked: Option<Duration>,
        stands: bool,
        position_mm: [f64; 3],
        tolerance_mm: f64,
    ) -> Judgement {
        let asked_after_ok = asked.zip(self.accepted).is_some_and(|(asked, accepted)| asked >= accepted);
        if !asked_after_ok || !stands {
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

/// Distance between two places.
pub(super) fn distance_mm(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Rounds to the controller's three decimals; no negative zero.
pub(super) fn round_to_um(mm: f64) -> f64 {
    (mm * 1000.0).round() / 1000.0 + 0.0
}
