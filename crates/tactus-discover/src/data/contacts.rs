//! The contacts in the data, and how they differ.

use std::collections::{BTreeMap, BTreeSet};

use tactus_calibrate::places::{Cell, SAME_PLACE_MM, distinct_places, far};
use tactus_model::Phase;

use super::frames::Frames;
use super::motion::{pressing, still, still_mm, stride};

/// Depths and speeds that differ by less count as the same.
const SAME_DEPTH_MM: f64 = 0.03;
const SAME_SPEED_RATIO: f64 = 1.5;
/// The tip rests if it is at the same place after so many strides.
const REST_STRIDES: usize = 3;
/// A way from elsewhere to a place is looked for in so many strides before.
const BACK_STRIDES: usize = 600;
/// The tip rises if it does by more over a [`stride`].
const RISES_MM: f64 = 0.005;
/// The speed of a load varies if it has so many frames and its quartiles differ by more than this factor: then they are no frames in
/// which a move at one speed starts or stops.
const FRAMES_MANY: usize = 20;
const VARIED_SPEED_RATIO: f64 = 2.0;

/// Contacts in order of time: unbroken sequences of frames below the surface. Where the tip rests a little below it, the next press is
/// another contact.
#[derive(Debug)]
pub(crate) struct Contacts<'a> {
    frames: &'a Frames,
    /// First frame, and the one after the last.
    spans: Vec<[usize; 2]>,
    still: Vec<usize>,
    /// Frames of a [`stride`].
    stride: usize,
    places: usize,
}

/// Where a contact's tip came from: in the positive direction of x, and of y.
type Sides = [bool; 2];

impl<'a> Contacts<'a> {
    pub(crate) fn of(frames: &'a Frames) -> Self {
        let touches = |frame: usize| frames.position_mm[frame][2] < 0.0 || pressing(frames.phase[frame]);
        let ends: Vec<usize> = frames.runs.iter().map(|(_, end)| *end).collect();
        let mut spans: Vec<[usize; 2]> = Vec::new();
        let mut press = -1;
        for frame in (0..frames.len()).filter(|frame| touches(*frame)) {
            let is_next = frames.press[frame] >= 0 && press >= 0 && frames.press[frame] != press;
            match spans.last_mut() {
                Some([_, end]) if *end == frame && !ends.contains(&frame) && !is_next => *end = frame + 1,
                _ => {
                    spans.push([frame, frame + 1]);
                    press = -1;
                }
            }
            press = press.max(frames.press[frame]);
        }
        let place = |[first, _]: &[usize; 2]| [0, 1].map(|axis| frames.position_mm[*first][axis]);
        let places = distinct_places(spans.iter().map(place)).len();
        Self { frames, spans, still: still(frames), stride: stride(frames), places }
    }

    pub(crate) fn count(&self) -> usize {
        self.spans.len()
    }

    /// Number of depths at which the tip rested, or that were the greatest of a contact.
    pub(crate) fn distinct_depths(&self) -> usize {
        let mut depths_mm: Vec<f64> = self
            .spans
            .iter()
            .flat_map(|[first, end]| {
                let rests = (*first..*end)
                    .filter(|frame| self.still[*frame] == REST_STRIDES * self.stride)
                    .map(|frame| self.depth_mm(frame));
                rests.chain([(*first..*end).map(|frame| self.depth_mm(frame)).fold(0.0, f64::max)])
            })
            .filter(|depth_mm| *depth_mm > 0.0)
            .collect();
        depths_mm.sort_by(f64::total_cmp);
        distinct(&depths_mm, |a, b| b - a > SAME_DEPTH_MM)
    }

    pub(crate) const fn distinct_places(&self) -> usize {
        self.places
    }

    pub(crate) fn longest_hold_s(&self) -> f64 {
        let holds = self.spans.iter().flat_map(|[first, end]| *first..*end);
        holds
            .map(|frame| self.frames.t_s[frame] - self.frames.t_s[frame - self.still[frame]])
            .fold(0.0, f64::max)
    }

    /// Longest time without contact after a contact.
    pub(crate) fn longest_rest_s(&self) -> f64 {
        let starts = self.spans.iter().skip(1).map(|[first, _]| *first).chain([self.frames.len()]);
        self.spans
            .iter()
            .zip(starts)
            .filter(|([_, end], next)| next > end)
            .map(|([_, end], next)| self.frames.t_s[next - 1] - self.frames.t_s[*end])
            .fold(0.0, f64::max)
    }

    /// True if the tip rises within a contact.
    pub(crate) fn falls_in_contact(&self) -> bool {
        let least_mm = RISES_MM.max(still_mm(self.frames));
        let rises = |frame: usize| self.depth_mm(frame) < self.depth_mm(frame - self.stride) - least_mm;
        self.spans.iter().any(|[first, end]| (first + self.stride..*end).any(rises))
    }

    /// Number of loading speeds. A load whose speed changes on the way, as in a half-sine stroke, has two.
    pub(crate) fn distinct_speeds(&self) -> usize {
        let loads: Vec<Vec<f64>> = self.spans.iter().map(|[first, end]| self.speeds(*first, *end)).collect();
        let quantile = |speeds: &[f64], share: usize| speeds.get(speeds.len() * share / 4).copied();
        let varies = |speeds: &Vec<f64>| {
            let ends = quantile(speeds, 1).zip(quantile(speeds, 3));
            speeds.len() >= FRAMES_MANY && ends.is_some_and(|(slow, fast)| fast > VARIED_SPEED_RATIO * slow)
        };
        let mut medians: Vec<f64> = loads.iter().filter_map(|speeds| quantile(speeds, 2)).collect();
        medians.sort_by(f64::total_cmp);
        let apart = distinct(&medians, |a, b| b / a > SAME_SPEED_RATIO);
        if loads.iter().any(varies) { apart.max(2) } else { apart }
    }

    /// True if one place was reached from different sides.
    pub(crate) fn approaches(&self) -> bool {
        let mut cells: BTreeMap<Cell, BTreeMap<Sides, BTreeSet<[u64; 2]>>> = BTreeMap::new();
        for (place, sides) in self.spans.iter().filter_map(|[first, _]| self.from(*first)) {
            cells
                .entry(Cell::of(place))
                .or_default()
                .entry(sides)
                .or_default()
                .insert(place.map(f64::to_bits));
        }
        let places = |of: &BTreeSet<[u64; 2]>| -> Vec<[f64; 2]> {
            of.iter().map(|place| place.map(f64::from_bits)).collect()
        };
        let meet = |some: &[[f64; 2]], others: &[[f64; 2]]| {
            some.iter().any(|place| others.iter().any(|other| !far(*place, *other)))
        };
        cells.iter().any(|(at, of_sides)| {
            at.around().filter_map(|near| cells.get(&near)).any(|of_others| {
                of_sides.iter().any(|(sides, some)| {
                    let different = of_others.iter().filter(|(others, _)| *others != sides);
                    let some = places(some);
                    different.into_iter().any(|(_, others)| meet(&some, &places(others)))
                })
            })
        })
    }

    /// True if a place was pressed more than once.
    pub(crate) fn repeats(&self) -> bool {
        self.distinct_places() < self.count()
    }

    /// Number of frames in contact with a moving tip.
    pub(crate) fn frames_in_motion(&self) -> usize {
        self.spans
            .iter()
            .flat_map(|[first, end]| *first..*end)
            .filter(|frame| self.still[*frame] == 0)
            .count()
    }

    fn depth_mm(&self, frame: usize) -> f64 {
        -self.frames.position_mm[frame][2]
    }

    /// Loading speeds of a contact, frame by frame, in ascending order.
    fn speeds(&self, first: usize, end: usize) -> Vec<f64> {
        let speed = |frame: usize| {
            let dt_s = self.frames.t_s[frame] - self.frames.t_s[frame - 1];
            (self.depth_mm(frame) - self.depth_mm(frame - 1)) / dt_s.max(1e-6)
        };
        let mut speeds: Vec<f64> =
            (first + 1..end).filter(|frame| self.frames.phase[*frame] != Phase::Unload).map(speed).collect();
        speeds.retain(|speed| *speed > 0.01);
        speeds.sort_by(f64::total_cmp);
        speeds
    }

    /// A contact's place, and whether it was last approached in the positive direction of x and of y.
    fn from(&self, first: usize) -> Option<([f64; 2], Sides)> {
        let [x, y, _] = self.frames.position_mm[first];
        let before =
            (0..first).rev().take(BACK_STRIDES * self.stride).map(|frame| self.frames.position_mm[frame]);
        let [from_x, from_y, _] = before.into_iter().find(|at| far([at[0], at[1]], [x, y]))?;
        Some(([x, y], [from_x < x - SAME_PLACE_MM, from_y < y - SAME_PLACE_MM]))
    }
}

/// Number of distinct values in a sorted list.
fn distinct(sorted: &[f64], differ: impl Fn(f64, f64) -> bool) -> usize {
    let mut last: Option<f64> = None;
    sorted
        .iter()
        .filter(|value| {
            let new = last.is_none_or(|last| differ(last, **value));
            if new {
                last = Some(**value);
            }
            new
        })
        .count()
}

#[cfg(test)]
#[path = "contacts_tests.rs"]
mod tests;
