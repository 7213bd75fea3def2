//! Decides whether a report of a move under way can belong to that move.

use core::time::Duration;

use super::distance_mm;

/// Where the reports of a move may lie, and how soon.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Course {
    from_mm: [f64; 3],
    target_mm: [f64; 3],
    speed_mm_per_s: f64,
    sent: Duration,
    shape: Shape,
}

/// Where a stage is on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// On the straight line, because the axes move together.
    Line,
    /// Between start and target on each axis, because each axis moves by itself.
    Box,
}

impl Course {
    /// A move that is sent now.
    pub(crate) fn new(
        now: Duration,
        from_mm: [f64; 3],
        target_mm: [f64; 3],
        speed_mm_per_s: f64,
        shape: Shape,
    ) -> Self {
        Self { from_mm, target_mm, speed_mm_per_s, sent: now, shape }
    }

    /// True if a stage that is on its way cannot be at this position by now: it has left the way, or is ahead of its speed.
    /// Twice the tolerance is allowed, for the controller's steps at both ends.
    pub(crate) fn strays(&self, now: Duration, position_mm: [f64; 3], tolerance_mm: f64) -> bool {
        let allowed_mm = 2.0 * tolerance_mm;
        let reach_mm = self.speed_mm_per_s * now.saturating_sub(self.sent).as_secs_f64();
        let ahead_mm = distance_mm(self.from_mm, position_mm) - reach_mm;
        let is_near = distance_mm(self.nearest_mm(position_mm), position_mm) <= allowed_mm;
        !(is_near && ahead_mm <= allowed_mm)
    }

    /// The nearest position on the way.
    fn nearest_mm(&self, position_mm: [f64; 3]) -> [f64; 3] {
        let way = |axis: usize| -> Option<[f64; 3]> {
            Some([*self.from_mm.get(axis)?, *self.target_mm.get(axis)?, *position_mm.get(axis)?])
        };
        match self.shape {
            Shape::Box => core::array::from_fn(|axis| {
                way(axis).map_or(0.0, |[from, to, at]| at.max(from.min(to)).min(from.max(to)))
            }),
            Shape::Line => {
                let length_mm = distance_mm(self.from_mm, self.target_mm);
                let gone_mm2: f64 =
                    (0..3).filter_map(way).map(|[from, to, at]| (at - from) * (to - from)).sum();
                let share =
                    if length_mm > 0.0 { (gone_mm2 / (length_mm * length_mm)).clamp(0.0, 1.0) } else { 0.0 };
                core::array::from_fn(|axis| way(axis).map_or(0.0, |[from, to, _]| from + share * (to - from)))
            }
        }
    }
}

#[cfg(test)]
#[path = "course_tests.rs"]
mod tests;
