//! The reach of the data: how deep and how fast they press. Beyond it no model is known, and so no experiment is proposed.

use crate::data::{Frames, load_speeds_mm_per_s};

/// How deep and how fast the data press.
#[derive(Debug, Clone)]
pub(super) struct Reach {
    /// The covering in place.
    pub(super) covering_mm: f64,
    /// Thickness and greatest depth of each covering, in the order of the frames.
    deepest_mm: Vec<(f64, f64)>,
    /// Mean speed of the fastest load; none if no load has two frames.
    pub(super) fastest_mm_per_s: Option<f64>,
}

/// Tolerance, as a factor, for depths that count as reached,
const NEARLY: f64 = 1.05;
/// and for the mean speed of a load: it depends a little on its depth.
const NEARLY_AS_FAST: f64 = 1.2;
/// Coverings whose thickness differs by less are the same.
const SAME_MM: f64 = 1e-6;

impl Reach {
    pub(super) fn of(frames: &Frames, covering_mm: f64) -> Self {
        Self { covering_mm, deepest_mm: deepest_mm(frames), fastest_mm_per_s: fastest_mm_per_s(frames) }
    }

    /// Greatest depth under the covering in place; 0 if the data have no press under it.
    pub(super) fn deepest_mm(&self) -> f64 {
        self.under(self.covering_mm)
    }

    /// Why rehearsed frames go beyond; `None` if they do not.
    pub(super) fn is_left_by(&self, rehearsed: &Frames) -> Option<String> {
        for (covering_mm, depth_mm) in deepest_mm(rehearsed) {
            let reached_mm = self.under(covering_mm);
            if depth_mm > 0.0 && reached_mm == 0.0 {
                return Some(format!("these data have no press under the covering of {covering_mm} mm"));
            }
            if !is_within(depth_mm, reached_mm) {
                return Some(format!(
                    "it presses {depth_mm:.3} mm deep under the covering of {covering_mm} mm, and these data only {reached_mm:.3} mm"
                ));
            }
        }
        let fastest = fastest_mm_per_s(rehearsed).zip(self.fastest_mm_per_s);
        let (wanted, reached) = fastest.filter(|(wanted, reached)| *wanted > NEARLY_AS_FAST * reached)?;
        Some(format!("it loads at {wanted:.2} mm/s, and these data only at {reached:.2} mm/s"))
    }

    fn under(&self, covering_mm: f64) -> f64 {
        let known = self.deepest_mm.iter().find(|(known_mm, _)| (known_mm - covering_mm).abs() < SAME_MM);
        known.map_or(0.0, |(_, deepest_mm)| *deepest_mm)
    }
}

/// Thickness and greatest depth of each covering.
fn deepest_mm(frames: &Frames) -> Vec<(f64, f64)> {
    let mut coverings: Vec<(f64, f64)> = Vec::new();
    for (covering_mm, position_mm) in frames.covering_mm.iter().zip(&frames.position_mm) {
        let depth_mm = (-position_mm[2]).max(0.0);
        match coverings.iter_mut().find(|(known_mm, _)| (known_mm - covering_mm).abs() < SAME_MM) {
            Some((_, deepest_mm)) => *deepest_mm = depth_mm.max(*deepest_mm),
            None => coverings.push((*covering_mm, depth_mm)),
        }
    }
    coverings
}

/// Greatest speed of a load, averaged over the load's time: near the covering the tip moves in steps.
fn fastest_mm_per_s(frames: &Frames) -> Option<f64> {
    load_speeds_mm_per_s(frames).reduce(f64::max)
}

/// True if a depth, a share or a speed is nearly reached.
pub(super) fn is_within(wanted: f64, reached: f64) -> bool {
    wanted <= NEARLY * reached
}
