//! How the tip moves: where it rests, turns, presses or is clear of the surface.

use tactus_model::Phase;

use super::frames::Frames;

/// A smaller movement counts as none.
pub(crate) const STILL_MM: f64 = 0.001;
/// Above this height, movements of the tip do not affect the readings.
pub(crate) const CLEAR_MM: f64 = 0.25;
/// Near the surface, a frame at which the speed of the stage changes by more is ignored: the stage does not start or stop at
/// once, and between two of its reports the position of the tip is not known.
const TURN_MM_PER_S: f64 = 1.2;

/// For every frame, the number of frames directly before it in which the tip was at the same place.
pub(crate) fn still(frames: &Frames) -> Vec<usize> {
    unchanged(frames, f64::INFINITY)
}

/// As [`still`], but ignores moves above a height.
pub(crate) fn unchanged(frames: &Frames, clear_mm: f64) -> Vec<usize> {
    let mut still = vec![0; frames.len()];
    let mut begin = 0;
    for (_, end) in &frames.runs {
        let start = begin;
        let mut anchor = start;
        for (frame, still) in still.iter_mut().enumerate().take(*end).skip(start) {
            let moved = (0..3).any(|axis| {
                (frames.position_mm[frame][axis] - frames.position_mm[anchor][axis]).abs() > STILL_MM
            });
            let clear = [frame, anchor].iter().all(|one| frames.position_mm[*one][2] > clear_mm);
            if (moved && !clear) || frames.press[frame] != frames.press[anchor] {
                anchor = frame;
            }
            *still = frame - anchor;
        }
        begin = *end;
    }
    still
}

/// True if the stage starts or stops at a frame, near the surface or in contact.
pub(crate) fn turns(frames: &Frames, frame: usize) -> bool {
    let Some(before) = frame.checked_sub(1).filter(|_| frame + 1 < frames.len()) else { return false };
    let z_mm = |frame: usize| frames.position_mm[frame][2];
    let speed = |from: usize| (z_mm(from + 1) - z_mm(from)) / (frames.t_s[from + 1] - frames.t_s[from]);
    // Time starts anew with each run.
    let is_one_run = frames.t_s[before] < frames.t_s[frame] && frames.t_s[frame] < frames.t_s[frame + 1];
    let least_mm = z_mm(before).min(z_mm(frame)).min(z_mm(frame + 1));
    is_one_run && least_mm < CLEAR_MM && (speed(frame) - speed(before)).abs() > TURN_MM_PER_S
}

/// Median time between frames.
pub(crate) fn interval_s(frames: &Frames) -> f64 {
    let mut intervals: Vec<f64> =
        frames.t_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|dt| *dt > 0.0).collect();
    intervals.sort_by(f64::total_cmp);
    intervals.get(intervals.len() / 2).copied().unwrap_or(1.0 / 30.0)
}

/// True between the first load and the end of the unload.
pub(crate) fn pressing(phase: Phase) -> bool {
    matches!(phase, Phase::Load | Phase::Hold | Phase::Unload)
}
