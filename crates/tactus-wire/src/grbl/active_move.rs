//! A straight move under way: its G-code line, and how reports are judged.

use core::time::Duration;

use super::Config;
use crate::stage::{ArrivalCheck, Judgement, distance_mm};

/// A move under way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ActiveMove {
    arrival: ArrivalCheck,
    line: String,
    /// When the controller accepted the line.
    accepted: Option<Duration>,
}

impl ActiveMove {
    /// A move that starts now. The target is rounded to the three decimals that are sent.
    pub(super) fn new(
        now: Duration,
        config: &Config,
        from_mm: [f64; 3],
        target_mm: [f64; 3],
        speed_mm_per_s: f64,
    ) -> Self {
        let machine_mm = config.to_machine(target_mm).map(round_to_um);
        let target_mm = config.to_stage(machine_mm);
        let [x, y, z] = machine_mm;
        let line = format!("G90 G21 G1 X{x:.3} Y{y:.3} Z{z:.3} F{:.3}", speed_mm_per_s * 60.0);
        let expected_s = distance_mm(from_mm, target_mm) / speed_mm_per_s;
        Self { arrival: ArrivalCheck::new(now, target_mm, expected_s), line, accepted: None }
    }

    /// The line to send, without its end.
    pub(super) fn line(&self) -> &str {
        &self.line
    }

    pub(super) fn arrival(&self) -> &ArrivalCheck {
        &self.arrival
    }

    /// True if the line has not been accepted yet.
    pub(super) fn awaits_ok(&self) -> bool {
        self.accepted.is_none()
    }

    pub(super) fn accept(&mut self, now: Duration) {
        self.accepted = Some(now);
    }

    /// Judges a report received now that was requested at `asked`. A report that was requested before the `ok` does not
    /// show that the move has ended.
    pub(super) fn judge(
        &mut self,
        now: Duration,
        asked: Option<Duration>,
        stands: bool,
        position_mm: [f64; 3],
        tolerance_mm: f64,
    ) -> Judgement {
        let asked_after_ok = asked.zip(self.accepted).is_some_and(|(asked, accepted)| asked >= accepted);
        self.arrival.judge(now, stands && asked_after_ok, position_mm, tolerance_mm)
    }
}

/// Rounds to the controller's three decimals; no negative zero.
fn round_to_um(mm: f64) -> f64 {
    (mm * 1000.0).round() / 1000.0 + 0.0
}
