//! The tip's way where no frame is read: straight between the points that are kept.
//!
//! A covering may remember presses of which no frame is read. Near the surface and below, the straight lines leave the way by no more than a
//! tolerance; higher up nothing but the sensor's own frames sees where the tip is.
//!
//! # Source
//! Points of a line that matter: U. Ramer, *Comput. Graph. Image Process.* 1 (1972) 244; D. H. Douglas and T. K. Peucker, *Cartographica* 10
//! (1973) 112.

use super::motion::CLEAR_MM;

/// A place of the tip at a moment of which no frame is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WayPoint {
    /// The frame that is read next.
    pub(crate) before: usize,
    /// Time since the run's first frame.
    pub(crate) t_s: f64,
    pub(crate) position_mm: [f64; 3],
    /// -1 between presses.
    pub(crate) press: i32,
}

/// The points of a way, in order of time, without those that straight lines between the others come as near to. Its ends are kept.
pub(super) fn bends(way: &[WayPoint], off_most_mm: f64) -> Vec<WayPoint> {
    let mut kept = vec![false; way.len()];
    let mut open = Vec::new();
    if let Some(last) = way.len().checked_sub(1) {
        (kept[0], kept[last]) = (true, true);
        open.push([0, last]);
    }
    while let Some([first, last]) = open.pop() {
        let off = (first + 1..last).map(|point| (point, off_mm(way[first], way[last], way[point])));
        let farthest = off.max_by(|one, other| one.1.total_cmp(&other.1));
        if let Some((point, _)) = farthest.filter(|(_, off_mm)| *off_mm > off_most_mm) {
            kept[point] = true;
            open.extend([[first, point], [point, last]]);
        }
    }
    way.iter().zip(kept).filter_map(|(point, kept)| kept.then_some(*point)).collect()
}

/// How far a point is from the straight line between two others at its time; 0 where both are clear of the surface.
fn off_mm(from: WayPoint, to: WayPoint, point: WayPoint) -> f64 {
    let share = (point.t_s - from.t_s) / (to.t_s - from.t_s).max(f64::MIN_POSITIVE);
    let on_line =
        |axis: usize| from.position_mm[axis] + share * (to.position_mm[axis] - from.position_mm[axis]);
    if point.position_mm[2].min(on_line(2)) > CLEAR_MM {
        return 0.0;
    }
    (0..3).map(|axis| (point.position_mm[axis] - on_line(axis)).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
#[path = "way_tests.rs"]
mod tests;
