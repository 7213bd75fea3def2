//! What the sensor has been through before each bin: contact, rest, speed, place and the largest depth so far.
//!
//! How the tip moves is told by its steps over a [`stride`].

use std::collections::VecDeque;

use super::bins::Bins;
use super::frames::{Frames, OnWay};
use super::motion::{still_mm, stride};

/// A sideways move shorter than this has no direction.
const ASIDE_MM: f64 = 0.05;

/// Covariates of the bins.
#[derive(Debug)]
pub(crate) struct History {
    pub(crate) since_contact_s: Vec<f64>,
    pub(crate) since_release_s: Vec<f64>,
    /// Since the stage started or stopped.
    pub(crate) since_turn_s: Vec<f64>,
    pub(crate) depth_mm: Vec<f64>,
    pub(crate) deepest_before_mm: Vec<f64>,
    pub(crate) upward: Vec<f64>,
    pub(crate) speed_mm_per_s: Vec<f64>,
    pub(crate) travel_mm_per_s: Vec<f64>,
    pub(crate) aside: [Vec<f64>; 2],
    /// Direction of the last move aside, of length 1.
    pub(crate) heading: Vec<[f64; 2]>,
    pub(crate) press: Vec<f64>,
    pub(crate) place_mm: [Vec<f64>; 2],
    pub(crate) last_place_mm: Vec<Option<[f64; 2]>>,
    pub(crate) temperature_c: Vec<f64>,
}

impl History {
    /// The covariates of each bin, from all frames up to its end.
    pub(crate) fn of(frames: &Frames, bins: &Bins) -> Self {
        let count = bins.len();
        let empty = || Vec::with_capacity(count);
        let mut history = Self {
            since_contact_s: empty(),
            since_release_s: empty(),
            since_turn_s: empty(),
            depth_mm: empty(),
            deepest_before_mm: empty(),
            upward: empty(),
            speed_mm_per_s: empty(),
            travel_mm_per_s: empty(),
            aside: [empty(), empty()],
            heading: Vec::with_capacity(count),
            press: empty(),
            place_mm: [empty(), empty()],
            last_place_mm: Vec::with_capacity(count),
            temperature_c: empty(),
        };
        let (still_mm, stride) = (still_mm(frames), stride(frames));
        let start = || SensorHistory { still_mm, stride, ..SensorHistory::default() };
        let mut state = start();
        let mut next = 0;
        let mut run = usize::MAX;
        for bin in 0..count {
            if bins.run[bin] != run {
                run = bins.run[bin];
                state = start();
            }
            for moment in frames.on_way(next..bins.first[bin + 1]) {
                state.take(moment);
            }
            next = bins.first[bin + 1];
            let frame = bins.first[bin];
            let (t_s, [x_mm, y_mm, z_mm]) = (bins.t_s[bin], bins.position_mm(frames, bin));
            history.since_contact_s.push(t_s - state.contact_s);
            history.since_release_s.push(state.release_s.map_or(f64::NAN, |release_s| t_s - release_s));
            history.since_turn_s.push(t_s - state.turn_s);
            history.depth_mm.push(if bins.moves[bin] { -z_mm } else { state.depth_mm });
            history.deepest_before_mm.push(state.deepest_before_mm);
            history.upward.push(f64::from(u8::from(state.upward)));
            history.speed_mm_per_s.push(state.speed_mm_per_s);
            history.travel_mm_per_s.push(state.travel_mm_per_s);
            history.aside[0].push(state.aside[0]);
            history.aside[1].push(state.aside[1]);
            history.heading.push(state.heading);
            history.press.push(state.presses);
            history.place_mm[0].push(x_mm);
            history.place_mm[1].push(y_mm);
            history.last_place_mm.push(state.last_place_mm.filter(|_| state.depth_mm <= 0.0));
            history.temperature_c.push(f64::from(frames.temperature_c[frame]));
        }
        history
    }
}

/// History of the sensor up to a frame.
#[derive(Debug, Default)]
struct SensorHistory {
    /// A movement that is no greater counts as none.
    still_mm: f64,
    stride: usize,
    /// Times and places before: from a stride ago on.
    before: VecDeque<(f64, [f64; 3])>,
    depth_mm: f64,
    contact_s: f64,
    release_s: Option<f64>,
    moves: bool,
    turn_s: f64,
    upward: bool,
    speed_mm_per_s: f64,
    travel_mm_per_s: f64,
    aside: [f64; 2],
    heading: [f64; 2],
    presses: f64,
    press: Option<i32>,
    deepest_mm: f64,
    deepest_before_mm: f64,
    last_place_mm: Option<[f64; 2]>,
}

impl SensorHistory {
    fn take(&mut self, moment: OnWay) {
        let OnWay { t_s, position_mm: at, press, .. } = moment;
        let depth_mm = -at[2];
        if let Some((last_s, last)) = self.before.front().copied() {
            let dt_s = (t_s - last_s).max(1e-6);
            let fell_mm = last[2] - at[2];
            if fell_mm.abs() > self.still_mm {
                self.upward = fell_mm < 0.0;
                if depth_mm > 0.0 {
                    self.speed_mm_per_s = fell_mm.abs() / dt_s;
                }
            }
            let aside = [at[0] - last[0], at[1] - last[1]];
            let far = aside[0].hypot(aside[1]);
            let moved_mm = far.max(fell_mm.abs());
            self.travel_mm_per_s = moved_mm / dt_s;
            if self.moves != (moved_mm > self.still_mm) {
                (self.moves, self.turn_s) = (!self.moves, t_s);
            }
            if far > ASIDE_MM {
                self.heading = aside.map(|moved| moved / far);
            }
            for (held, moved) in self.aside.iter_mut().zip(aside) {
                if moved.abs() > ASIDE_MM.min(far) && moved.abs() > self.still_mm {
                    *held = moved.signum();
                }
            }
        }
        if press >= 0 && self.press != Some(press) {
            self.press = Some(press);
            self.presses += 1.0;
            self.deepest_before_mm = self.deepest_mm;
        }
        let touched = self.depth_mm > 0.0;
        if depth_mm > 0.0 {
            if !touched {
                self.contact_s = t_s;
            }
            self.deepest_mm = self.deepest_mm.max(depth_mm);
            self.last_place_mm = Some([at[0], at[1]]);
        } else if touched {
            self.release_s = Some(t_s);
        }
        self.depth_mm = depth_mm;
        if self.before.len() == self.stride {
            self.before.pop_front();
        }
        self.before.push_back((t_s, at));
    }
}
