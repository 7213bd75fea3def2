//! Where the tip goes so slowly and so straight that frames may be averaged.
//!
//! The mean of readings along a straight way is the reading at its middle, but for how much the response bends on it. It bends most where the
//! tip touches the covering, and nobody knows exactly where that is. So a way begins below the surface, once the readings show the contact.

use super::bins::PressSpan;
use super::frames::Frames;
use super::motion::{STILL_MM, pressing, still_mm};
use super::noise::Noise;

/// A bin holds at most such a part of the way from the surface to the greatest depth of its press.
const DEPTH_PARTS: f64 = 32.0;
/// A contact shows where a reading is farther from the element's zero than so many standard deviations of the noise.
const SHOWS_Z: f64 = 8.0;
/// Frames before a press of which the mean of an element's readings is its zero.
const ZERO_FRAMES: usize = 15;

/// The ways of the tip in contact that are even.
pub(super) struct SlowWays {
    /// For every frame, the number of frames directly before it on the same way.
    since: Vec<usize>,
    /// For every frame, how far a bin may reach.
    most_mm: Vec<f64>,
}

impl SlowWays {
    /// None: only where the tip rests frames are averaged.
    pub(super) fn none(frames: &Frames) -> Self {
        Self { since: vec![0; frames.len()], most_mm: Vec::new() }
    }

    pub(super) fn of(frames: &Frames, noise: &Noise) -> Self {
        // Of positions that jitter nobody knows how straight they are.
        if still_mm(frames) > STILL_MM {
            return Self::none(frames);
        }
        let shows = shows(frames, noise);
        let mut since = vec![0; frames.len()];
        let mut begin = 0;
        for (_, end) in &frames.runs {
            for frame in begin + 2..*end {
                let three = [frame - 2, frame - 1, frame];
                if three.into_iter().all(|one| shows[one]) && goes_on(frames, three) {
                    since[frame] = since[frame - 1] + 1;
                }
            }
            begin = *end;
        }
        let mut most_mm = vec![0.0; frames.len()];
        for press in PressSpan::of(frames) {
            most_mm[press.first..press.end].fill(press.depth_mm / DEPTH_PARTS);
        }
        Self { since, most_mm }
    }

    /// The number of frames directly before this one on the same way.
    pub(super) fn since(&self, frame: usize) -> usize {
        self.since[frame]
    }

    /// True if a bin that begins with a frame may go on to a later one, as it did to all between: if the way to it is short and straight.
    pub(super) fn reaches(&self, frames: &Frames, first: usize, frame: usize) -> bool {
        if self.since[frame] <= self.since[frame - 1] {
            return false;
        }
        let at = |frame: usize| (frames.t_s[frame], frames.position_mm[frame]);
        let ((from_s, from), (to_s, to)) = (at(first), at(frame));
        let far_mm = (0..3).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f64>().sqrt();
        let is_straight = (first + 1..frame).map(at).all(|(t_s, between)| {
            let share = (t_s - from_s) / (to_s - from_s);
            (0..3).all(|axis| {
                let straight = from[axis] + share * (to[axis] - from[axis]);
                (between[axis] - straight).abs() <= STILL_MM
            })
        });
        far_mm <= self.most_mm[first] && is_straight
    }
}

/// True if the tip moves to the second of three frames, and on to the third as it did to that. Three positions that are off by half of what
/// counts as no movement make twice that much of a second difference.
fn goes_on(frames: &Frames, [a, b, c]: [usize; 3]) -> bool {
    let is_next = [b, c].into_iter().all(|one| {
        (frames.press[one], frames.phase[one]) == (frames.press[a], frames.phase[a])
            && !frames.is_after_gap(one)
            && frames.t_s[one] > frames.t_s[one - 1]
    });
    let times = (frames.t_s[c] - frames.t_s[b]) / (frames.t_s[b] - frames.t_s[a]);
    let [a, b, c] = [a, b, c].map(|frame| frames.position_mm[frame]);
    let moves = |from: [f64; 3], to: [f64; 3]| (0..3).any(|axis| (to[axis] - from[axis]).abs() > STILL_MM);
    let is_even =
        (0..3).all(|axis| ((c[axis] - b[axis]) - times * (b[axis] - a[axis])).abs() <= 2.0 * STILL_MM);
    is_next && is_even && moves(a, b) && moves(b, c)
}

/// For every frame, whether the tip is below the surface and its readings show a contact.
fn shows(frames: &Frames, noise: &Noise) -> Vec<bool> {
    let mut shows = Vec::with_capacity(frames.len());
    for (_, end) in &frames.runs {
        let mut before = shows.len()..shows.len();
        let mut zeros: Vec<f64> = Vec::new();
        for frame in shows.len()..*end {
            if !pressing(frames.phase[frame]) {
                let is_next = before.end == frame && !frames.is_after_gap(frame);
                let first = if is_next { before.start } else { frame };
                before = first.max((frame + 1).saturating_sub(ZERO_FRAMES))..frame + 1;
                zeros.clear();
                shows.push(false);
                continue;
            }
            if zeros.is_empty() && !before.is_empty() {
                zeros = frames.mean_counts(before.clone());
            }
            let mut readings = frames.counts_of(frame).iter().zip(&zeros).zip(&noise.by_element_counts);
            let is_off = |((counts, zero), rms): ((&f32, &f64), &f64)| {
                (f64::from(*counts) - zero).abs() > SHOWS_Z * rms
            };
            shows.push(frames.position_mm[frame][2] < 0.0 && readings.any(is_off));
        }
    }
    shows
}

#[cfg(test)]
#[path = "slow_ways_tests.rs"]
mod tests;
