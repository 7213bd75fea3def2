//! The speed of the moves, and the controller's modes that they rely on. Both are read back before anything moves.

use super::number::{round_to_um, short};

/// The controller prints the feed as a whole number.
const PRINTED_MM_PER_MIN: f64 = 0.5 + 1e-6;

/// The modes of every move: straight at the feed, by increments, in mm, per minute.
const MODES: [&str; 4] = ["G1", "G91", "G21", "G94"];

/// A feed in mm/min, with three decimals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feed(f64);

impl Feed {
    pub(super) fn of(speed_mm_per_s: f64) -> Self {
        Self(round_to_um(speed_mm_per_s * 60.0))
    }

    /// The line that sets it, with the modes; without its end.
    pub(super) fn line(self) -> String {
        format!("G91G21G94G1F{}", short(self.0))
    }

    /// True if this is the answer to `$G` of a controller that has this feed and the modes. `None` for anything else.
    pub(super) fn is_told(self, feedback: &str) -> Option<bool> {
        let words: Vec<&str> = feedback.strip_prefix("GC:")?.split(' ').collect();
        let feed: Option<f64> =
            words.iter().find_map(|word| word.strip_prefix('F')).and_then(|feed| feed.parse().ok());
        let is_near = |feed: f64| (feed - self.0).abs() <= PRINTED_MM_PER_MIN;
        Some(feed.is_some_and(is_near) && MODES.iter().all(|mode| words.contains(mode)))
    }
}

#[cfg(test)]
#[path = "feed_tests.rs"]
mod tests;
