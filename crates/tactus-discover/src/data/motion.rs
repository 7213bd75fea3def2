//! How the tip moves: where it rests, turns, presses or is clear of the surface.

use std::f64::consts::SQRT_2;

use tactus_model::Phase;

use super::frames::Frames;
use crate::numbers::{NORMAL_PER_MEDIAN, median};

/// A smaller movement counts as none, unless positions jitter by more.
pub(super) const STILL_MM: f64 = 0.001;
/// What a step from frame to frame means is one over this time where frames are nearer to each other: that of the paper's sensor.
pub(super) const STRIDE_S: f64 = 1.0 / 30.0;
/// An interval that is longer than so many usual ones is a pause.
const PAUSE: f64 = 2.5;
/// A jitter of positions is told from rests in which no step from frame to frame is longer.
const JITTER_MOST_MM: f64 = 0.02;
/// Fewer second differences of positions do not tell a jitter.
const JITTER_LEAST: usize = 20;
/// Two positions of a tip at rest differ by no more standard deviations: by chance, one pair in `5e8`.
const JITTER_Z: f64 = 6.0;
/// Above this height, movements of the tip do not affect the readings.
pub(crate) const CLEAR_MM: f64 = 0.25;
/// Near the surface, a frame at which the speed of the stage changes by more is ignored: the stage does not start or stop at
/// once, and between two of its reports the position of the tip is not known.
const TURN_MM_PER_S: f64 = 1.2;

/// A movement that is no greater counts as none: [`STILL_MM`], or what a jitter of the positions makes of a tip at rest.
pub(crate) fn still_mm(frames: &Frames) -> f64 {
    let jitter_mm = jitter_mm(frames, |frame| frames.phase[frame] == Phase::Hold);
    let jitter_mm = jitter_mm.or_else(|| self::jitter_mm(frames, |_| true)).unwrap_or(0.0);
    STILL_MM.max(JITTER_Z * SQRT_2 * jitter_mm)
}

/// Standard deviation of the positions of a tip at rest, along the axis that jitters most: from the median second difference among frames, which
/// moves at one speed do not change. `None` of too few.
fn jitter_mm(frames: &Frames, is_among: impl Fn(usize) -> bool) -> Option<f64> {
    let mut bends: [Vec<f64>; 3] = Default::default();
    for last in 2..frames.len() {
        let three = [last - 2, last - 1, last];
        let is_next = |pair: &[usize]| {
            frames.t_s[pair[0]] < frames.t_s[pair[1]]
                && frames.press[pair[0]] == frames.press[pair[1]]
                && !frames.is_after_gap(pair[1])
        };
        if !(three.into_iter().all(&is_among) && three.windows(2).all(is_next)) {
            continue;
        }
        let [a, b, c] = three.map(|frame| frames.position_mm[frame]);
        if (0..3).all(|axis| (b[axis] - a[axis]).abs().max((c[axis] - b[axis]).abs()) <= JITTER_MOST_MM) {
            bends
                .iter_mut()
                .enumerate()
                .for_each(|(axis, of)| of.push((a[axis] - 2.0 * b[axis] + c[axis]).abs()));
        }
    }
    // `a - 2 b + c` has six times the variance.
    let deviation = |bends: &Vec<f64>| NORMAL_PER_MEDIAN * median(bends) / 6.0_f64.sqrt();
    (bends[0].len() >= JITTER_LEAST).then(|| bends.iter().map(deviation).fold(0.0, f64::max))
}

/// For every frame, the number of frames directly before it in which the tip was at the same place.
pub(crate) fn still(frames: &Frames) -> Vec<usize> {
    unchanged(frames, f64::INFINITY)
}

/// As [`still`], but ignores moves above a height.
pub(crate) fn unchanged(frames: &Frames, clear_mm: f64) -> Vec<usize> {
    let still_mm = still_mm(frames);
    let mut still = vec![0; frames.len()];
    let mut begin = 0;
    for (_, end) in &frames.runs {
        let start = begin;
        let mut anchor = start;
        for (frame, still) in still.iter_mut().enumerate().take(*end).skip(start) {
            let moved = (0..3).any(|axis| {
                (frames.position_mm[frame][axis] - frames.position_mm[anchor][axis]).abs() > still_mm
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

/// Number of frames in [`STRIDE_S`]; at least 1.
pub(crate) fn stride(frames: &Frames) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
    let stride = (STRIDE_S / interval_s(frames)).round() as usize;
    stride.max(1)
}

/// For every frame, whether the stage starts or stops at it, near the surface or in contact. From press to press it does neither.
pub(crate) fn turns(frames: &Frames) -> Vec<bool> {
    let (still_mm, stride) = (still_mm(frames), stride(frames));
    let longest_s = PAUSE * stride as f64 * interval_s(frames);
    // A jitter makes a second difference of so much at most.
    let jitter_mm = if still_mm > STILL_MM { 3.0_f64.sqrt() * still_mm } else { 0.0 };
    let turns = |frame: usize| {
        let after = frame + stride;
        let Some(before) = frame.checked_sub(stride).filter(|_| after < frames.len()) else { return false };
        let z_mm = |frame: usize| frames.position_mm[frame][2];
        let time_s = |from: usize| frames.t_s[from + stride] - frames.t_s[from];
        let speed = |from: usize| (z_mm(from + stride) - z_mm(from)) / time_s(from);
        // Time starts anew with each run.
        let is_one_way =
            [before, frame].into_iter().all(|from| (f64::MIN_POSITIVE..=longest_s).contains(&time_s(from)));
        let mut presses =
            [before, frame, after].into_iter().map(|one| frames.press[one]).filter(|press| *press >= 0);
        let is_one_press = presses.next().is_none_or(|press| presses.all(|other| other == press));
        let least_mm = z_mm(before).min(z_mm(frame)).min(z_mm(after));
        let least_mm_per_s = TURN_MM_PER_S.max(jitter_mm / time_s(before).min(time_s(frame)));
        let changes = (speed(frame) - speed(before)).abs() > least_mm_per_s;
        is_one_way && is_one_press && least_mm < CLEAR_MM && changes
    };
    (0..frames.len()).map(turns).collect()
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

/// The same over a [`stride`].
fn falls(frames: &Frames) -> impl Iterator<Item = Fall> {
    let stride = stride(frames);
    (stride..frames.len()).filter_map(move |later| {
        let pair = [later - stride, later];
        let is_load = pair.iter().all(|one| frames.phase[*one] == Phase::Load);
        let [press, press_later] = pair.map(|one| frames.press[one]);
        let way_mm = frames.position_mm[later - stride][2] - frames.position_mm[later][2];
        let time_s = frames.t_s[later] - frames.t_s[later - stride];
        let falls = is_load && press == press_later && way_mm > STILL_MM && time_s > 0.0;
        falls.then_some(Fall { press, way_mm, time_s })
    })
}

/// True between the first load and the end of the unload.
pub(crate) fn pressing(phase: Phase) -> bool {
    matches!(phase, Phase::Load | Phase::Hold | Phase::Unload)
}

#[cfg(test)]
#[path = "motion_tests.rs"]
mod tests;
