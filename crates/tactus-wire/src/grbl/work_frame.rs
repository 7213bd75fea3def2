//! The controller's work frame, which must be its machine frame.

use super::{Position, StatusReport};

/// Half of the reporting resolution. Smaller offsets are none.
const SAME_PLACE_MM: f64 = 0.0005;

/// What reports have told of the work frame since the last reset.
///
/// Positions are those of the machine frame, so that an offset that somebody has left (`G54`, `G92`) does not move them.
#[derive(Debug, Clone, Default)]
pub(super) struct WorkFrame {
    /// Origin in the machine frame, as last told.
    offset_mm: Option<[f64; 3]>,
    /// The last position was one of the work frame.
    is_needed: bool,
}

impl WorkFrame {
    /// Takes a report, and gives its position in the machine frame. Until an offset is told, it is taken for 0.
    pub(super) fn take(&mut self, report: &StatusReport) -> [f64; 3] {
        self.offset_mm = report.work_offset_mm.or(self.offset_mm);
        self.is_needed = matches!(report.position, Position::Work(_));
        match report.position {
            Position::Machine(mm) => mm,
            Position::Work([x, y, z]) => {
                let [offset_x, offset_y, offset_z] = self.offset_mm.unwrap_or_default();
                [x + offset_x, y + offset_y, z + offset_z]
            }
        }
    }

    /// Forgets it, after a reset.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// The offset that somebody has left in the controller.
    pub(super) fn foreign_mm(&self) -> Option<[f64; 3]> {
        self.offset_mm.filter(|mm| mm.iter().any(|mm| mm.abs() > SAME_PLACE_MM))
    }

    /// True if positions are told in the work frame, and not where that is.
    pub(super) fn is_unknown(&self) -> bool {
        self.is_needed && self.offset_mm.is_none()
    }
}

#[cfg(test)]
#[path = "work_frame_tests.rs"]
mod tests;
