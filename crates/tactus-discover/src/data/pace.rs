//! The pace of a fast sensor: of a long recording, frames that follow each other are read as their mean.
//!
//! What a discovery looks at changes within a press, in tenths of a second. A sensor of 1,000 frames a second fills what may be read
//! ([`super::excerpt`]) within ten presses. Where there are too many frames, each two are joined, and again each two of those, as long as a frame is left as
//! often as the paper's sensor gives one. Only then whole presses are left out.
//!
//! Frames are joined within a stretch: one run, press, phase and tool, with the tip on one side of the surface, and no pause between them. What is left at the
//! end of a stretch is joined to the frame before, if it is less than half of one. A frame is thus the mean of half to one and a half times as many as most,
//! unless its stretch is shorter.
//!
//! A mean over a thirtieth of a second hides a faster tone, and gives it another frequency. So no frames are joined where a line stands out of the
//! spectrum of what the elements read, nor where their noise is too small beside the converter's step for means to tell more than single readings. Both are
//! asked once, of the frames that come first.

use super::converter::Converter;
use super::frames::Frames;
use super::motion::{STRIDE_S, interval_s};
use super::noise::Noise;
use super::spectrum;

/// A frame and the next that joins it are apart by so much of [`STRIDE_S`] at most: two of half a stride, with some jitter.
const APART: f64 = 0.55;
/// The same of what is left at the end of a stretch: a full frame and less than half of one.
const APART_AT_END: f64 = 0.75;
/// The share by which usual frames may be means of more or fewer.
const USUAL: f64 = 0.25;
/// Noise of half a step, and the rounding beside it, in steps: it dithers so well that next to nothing of the rounding repeats.
const DITHERED_STEPS: f64 = 0.577;
/// Of a rate that is so much less than twice that of the paper's sensor each two frames are joined too.
const TOLERANCE: f64 = 0.05;

/// Frames of one stretch that become one.
#[derive(Debug, Clone, Copy)]
struct Group {
    first: usize,
    end: usize,
    /// The frames that were given.
    given: u32,
}

impl Frames {
    /// Joins each two frames, if that leaves enough in a second. False if none were joined.
    pub(super) fn slow_down(&mut self) -> bool {
        if 2.0 * interval_s(self) > (1.0 + TOLERANCE) * STRIDE_S || !self.may_be_joined() {
            return false;
        }
        let (before, each) = (self.len(), self.excerpt.each);
        self.excerpt.each *= 2;
        self.join(0);
        let is_slower = self.len() < before;
        if !is_slower {
            self.excerpt.each = each;
        }
        is_slower
    }

    /// True if means tell as much as the frames that they are of. It is asked as long as frames are as they were given.
    fn may_be_joined(&mut self) -> bool {
        if let Some(known) = self.excerpt.may_be_joined {
            return known;
        }
        if !spectrum::is_seen(self) {
            return false;
        }
        let may_be = self.is_without_tones() && self.is_dithered();
        self.excerpt.may_be_joined = Some(may_be);
        may_be
    }

    fn is_without_tones(&self) -> bool {
        let known = |counts: &f32| if counts.is_finite() { f64::from(*counts) } else { 0.0 };
        let counts: Vec<f64> = self.counts.iter().map(known).collect();
        spectrum::lines(self, 1, &counts).is_empty()
            && spectrum::lines_in_contact(self, 1, &counts).is_empty()
    }

    /// True if the noise moves readings by half a step, where all lie on steps. False of too few different readings.
    fn is_dithered(&self) -> bool {
        let is_dithered = |step_counts: f64| {
            Noise::of_differences(self, step_counts).rms_counts >= DITHERED_STEPS * step_counts
        };
        Converter::step_of(&self.counts).is_some_and(is_dithered)
    }

    /// Of how many frames that were given one here mostly is the mean: half of those are in frames of no more.
    pub fn joined(&self) -> u32 {
        if self.excerpt.each == 1 {
            return 1;
        }
        let mut joined = self.joined.clone();
        joined.sort_unstable();
        let all: u64 = joined.iter().map(|joined| u64::from(*joined)).sum();
        let mut so_far = 0;
        let is_half = |joined: &u32| {
            so_far += u64::from(*joined);
            2 * so_far >= all
        };
        joined.into_iter().find(is_half).unwrap_or(1)
    }

    /// For each frame, of how many frames it is the mean beside most: its inverse variance beside theirs.
    pub(crate) fn shares(&self) -> Vec<f64> {
        let usual = f64::from(self.joined());
        self.joined.iter().map(|joined| f64::from(*joined) / usual).collect()
    }

    /// For each frame, whether it is the mean of nearly as many as most.
    pub(crate) fn are_usual(&self) -> Vec<bool> {
        self.shares().iter().map(|share| (share - 1.0).abs() <= USUAL).collect()
    }

    /// The step with which the frames scatter as single readings do with the converter's own: noise dithers what is joined.
    pub(crate) fn step_of_means(&self, step_counts: f64) -> f64 {
        step_counts / f64::from(self.joined()).sqrt()
    }

    /// Joins those of the last frames, from one on, that belong together. The last of all may still be joined by frames to come.
    pub(super) fn join(&mut self, from: usize) {
        let groups = self.groups(from);
        if groups.len() == self.len() - from {
            return;
        }
        for (place, group) in (from..).zip(&groups) {
            // Those before the first that is joined stay where they are.
            if group.end > place + 1 {
                self.become_one(place, *group);
            }
        }
        let count = from + groups.len();
        // The new place of a frame that begins a group, or of the end.
        let place = |old: usize| from + groups.partition_point(|group| group.first < old);
        for (_, end) in self.runs.iter_mut().rev().take_while(|(_, end)| *end > from) {
            *end = place(*end);
        }
        for (_, first) in self.excerpt.read.iter_mut().rev().take_while(|(_, first)| *first > from) {
            *first = place(*first);
        }
        for point in self.way.iter_mut().rev().take_while(|point| point.before > from) {
            point.before = place(point.before);
        }
        self.truncate(count);
    }

    fn groups(&self, from: usize) -> Vec<Group> {
        let each = self.excerpt.each;
        let mut full: Vec<Group> = Vec::new();
        for frame in from..self.len() {
            let given = self.joined[frame];
            match full.last_mut() {
                Some(last) if last.given + given <= each && self.follows(frame, APART) => {
                    (last.end, last.given) = (frame + 1, last.given + given);
                }
                _ => full.push(Group { first: frame, end: frame + 1, given }),
            }
        }
        let open = full.pop();
        let mut groups: Vec<Group> = Vec::new();
        for group in full {
            match groups.last_mut() {
                Some(last) if 2 * group.given < each && self.follows(group.first, APART_AT_END) => {
                    (last.end, last.given) = (group.end, last.given + group.given);
                }
                _ => groups.push(group),
            }
        }
        groups.extend(open);
        groups
    }

    /// True if a frame is of one stretch with the one before, and apart from it by no more.
    fn follows(&self, frame: usize, apart: f64) -> bool {
        let before = frame - 1;
        let is_above = |frame: usize| self.position_mm[frame][2] > 0.0;
        let apart_s = self.t_s[frame] - self.t_s[before];
        let begins_run = || self.runs.binary_search_by_key(&frame, |(_, end)| *end).is_ok();
        let begins_part = || self.excerpt.read.binary_search_by_key(&frame, |(_, first)| *first).is_ok();
        self.press[frame] == self.press[before]
            && self.phase[frame] == self.phase[before]
            && self.indenter[frame] == self.indenter[before]
            && self.covering_mm[frame].to_bits() == self.covering_mm[before].to_bits()
            && is_above(frame) == is_above(before)
            && apart_s > 0.0
            && apart_s <= apart * STRIDE_S
            && !begins_run()
            && !begins_part()
            && !self.is_after_gap(frame)
    }

    /// Puts the mean of a group at a place that is no later than its first frame.
    fn become_one(&mut self, place: usize, Group { first, end, given }: Group) {
        let elements = self.elements;
        let shares: Vec<f64> =
            self.joined[first..end].iter().map(|joined| f64::from(*joined) / f64::from(given)).collect();
        let mean = |value: &dyn Fn(usize) -> f64| {
            (first..end).zip(&shares).map(|(frame, share)| share * value(frame)).sum::<f64>()
        };
        #[expect(clippy::cast_possible_truncation, reason = "as precise as a reading")]
        let single = |value: f64| value as f32;
        self.t_s[place] = mean(&|frame| self.t_s[frame]);
        self.position_mm[place] = std::array::from_fn(|axis| mean(&|frame| self.position_mm[frame][axis]));
        let known = || {
            let all = self.temperature_c[first..end].iter().zip(&shares);
            all.filter(|(temperature_c, _)| !temperature_c.is_nan())
        };
        let sum: f64 = known().map(|(temperature_c, share)| f64::from(*temperature_c) * share).sum();
        self.temperature_c[place] = single(sum / known().map(|(_, share)| share).sum::<f64>());
        for element in 0..elements {
            let counts = mean(&|frame| f64::from(self.counts[frame * elements + element]));
            self.counts[place * elements + element] = single(counts);
        }
        self.number[place] = self.number[first];
        self.press[place] = self.press[first];
        self.phase[place] = self.phase[first];
        self.covering_mm[place] = self.covering_mm[first];
        self.indenter[place] = self.indenter[first];
        self.joined[place] = given;
    }

    fn truncate(&mut self, count: usize) {
        self.number.truncate(count);
        self.press.truncate(count);
        self.phase.truncate(count);
        self.t_s.truncate(count);
        self.position_mm.truncate(count);
        self.covering_mm.truncate(count);
        self.indenter.truncate(count);
        self.temperature_c.truncate(count);
        self.joined.truncate(count);
        self.counts.truncate(count * self.elements);
    }
}

#[cfg(test)]
#[path = "pace_tests.rs"]
mod tests;
