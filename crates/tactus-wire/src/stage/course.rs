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
        match self.shape {
            Shape::Box => {
                let way = by_axis(self.from_mm, self.target_mm, position_mm);
                way.map(|[from, to, at]| at.max(from.min(to)).min(from.max(to)))
            }
            Shape::Line => nearest_on_line_mm(self.from_mm, self.target_mm, position_mm),
        }
    }
}

/// The nearest position on the straight line between two others.
pub(crate) fn nearest_on_line_mm(from_mm: [f64; 3], to_mm: [f64; 3], position_mm: [f64; 3]) -> [f64; 3] {
    let way = by_axis(from_mm, to_mm, position_mm);
    let length_mm = distance_mm(from_mm, to_mm);
    let gone_mm2: f64 = way.iter().map(|[from, to, at]| (at - from) * (to - from)).sum();
    let share = if length_mm > 0.0 { (gone_mm2 / (length_mm * length_mm)).clamp(0.0, 1.0) } else { 0.0 };
    way.map(|[from, to, _]| from + share * (to - from))
}

fn by_axis([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3], [cx, cy, cz]: [f64; 3]) -> [[f64; 3]; 3] {
    [[ax, bx, cx], [ay, by, cy], [az, bz, cz]]
}

#[cfg(test)]
#[path = "course_tests.rs"]
mod tests;
