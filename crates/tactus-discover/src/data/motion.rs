//! How the tip moves: where it rests, turns, presses or is clear of the surface.

use tactus_model::Phase;

use super::frames::Frames;
use crate::numbers::median;

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
            let is_other = frames.press[frame] != frames.press[anchor] || frames.is_after_gap(frame);
            if (moved && !clear) || is_other {
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

/// Mean speed of each load: of one press, while the tip goes down. Near the covering that is less than what was commanded, because the
/// tip stands between two steps.
pub(crate) fn load_speeds_mm_per_s(frames: &Frames) -> impl Iterator<Item = f64> {
    let mut loads: Vec<Fall> = Vec::new();
    for fall in falls(frames) {
        match loads.last_mut() {
            // Numbers of presses begin anew with each run, but no two presses with the same number follow each other.
            Some(load) if load.press == fall.press => {
                load.way_mm += fall.way_mm;
                load.time_s += fall.time_s;
            }
            _ => loads.push(fall),
        }
    }
    loads.into_iter().map(Fall::speed_mm_per_s)
}

/// The speed at which the tip mostly goes down in loads: what was commanded. None if no load has two frames.
pub(crate) fn load_speed_mm_per_s(frames: &Frames) -> Option<f64> {
    let speeds: Vec<f64> = falls(frames).map(Fall::speed_mm_per_s).collect();
    (!speeds.is_empty()).then(|| median(&speeds))
}

/// The way of the tip down from one frame of a load to the next.
#[derive(Debug, Clone, Copy)]
struct Fall {
    press: i32,
    way_mm: f64,
    time_s: f64,
}

impl Fall {
    fn speed_mm_per_s(self) -> f64 {
        self.way_mm / self.time_s
    }
}

fn falls(frames: &Frames) -> impl Iterator<Item = Fall> {
    (1..frames.len()).filter_map(|later| {
        let pair = [later - 1, later];
        let is_load = pair.iter().all(|one| frames.phase[*one] == Phase::Load);
        let [press, press_later] = pair.map(|one| frames.press[one]);
        let way_mm = frames.position_mm[later - 1][2] - frames.position_mm[later][2];
        let time_s = frames.t_s[later] - frames.t_s[later - 1];
        let falls = is_load && press == press_later && way_mm > STILL_MM && time_s > 0.0;
        falls.then_some(Fall { press, way_mm, time_s })
    })
}

/// True between the first load and the end of the unload.
pub(crate) fn pressing(phase: Phase) -> bool {
    matches!(phase, Phase::Load | Phase::Hold | Phase::Unload)
}
