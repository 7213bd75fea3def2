//! Which frames of a long recording are read, so that what a discovery costs is bounded.
//!
//! Up to [`READINGS_MOST`] readings all are read. Of a longer recording frames of a fast sensor are joined first ([`super::pace`]). Then one part of two is, then one of four, and so on. A part is a press with
//! the rest that follows it, up to the next press; one with more than one in [`PART_SHARE`] of the frames that may be read counts as several.
//! Which one of a group is read is drawn, because presses often come in an order that repeats.
//!
//! Of the other parts the tip's way is kept ([`super::way`]), because a covering remembers presses.
//!
//! Frames are given one after the other. At no time more are kept than may be read, and one.

use super::frames::Frames;
use super::way::{WayPoint, bends};
use crate::numbers::Rng;

/// Greatest number of readings that are read: 13 minutes of the paper's sensor.
const READINGS_MOST: usize = 48 * 24_000;
/// A part has at most one in so many of the frames that may be read.
const PART_SHARE: usize = 16;
/// Straight lines leave the way by at most so much.
const OFF_MM: f64 = 0.02;
/// Points of a way that are thinned out together where parts are as long as a fast sensor makes them: the time may grow with their square.
const POINTS_AT_ONCE: usize = 2048;
/// Changes the seed of each group's draw.
const STREAM: u64 = 0x0065_7863_6572_7074;

/// How much of the frames that are given is read.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Excerpt {
    pub(super) frames_most: usize,
    /// So many frames that are given are joined to one.
    pub(super) each: u32,
    /// Whether frames may be joined; `None` before that was asked.
    pub(super) may_be_joined: Option<bool>,
    /// Of `2^halvings` parts one is read.
    halvings: u32,
    /// Run and press of the last frame that was given; -1 before the run's first press.
    run: String,
    press: i32,
    /// Number of parts so far, how many frames the last one has, and whether it is read.
    parts: u64,
    length: u64,
    reads: bool,
    /// The number and the first frame of each part that is read.
    pub(super) read: Vec<(u64, usize)>,
}

impl Default for Excerpt {
    fn default() -> Self {
        Self::of_frames(READINGS_MOST)
    }
}

impl Excerpt {
    /// Of an array with so many elements.
    pub(super) fn of_elements(elements: usize) -> Self {
        Self::of_frames(READINGS_MOST / elements.max(1))
    }

    /// At most so many frames.
    pub(super) const fn of_frames(frames_most: usize) -> Self {
        Self {
            frames_most,
            each: 1,
            may_be_joined: None,
            halvings: 0,
            run: String::new(),
            press: -1,
            parts: 0,
            length: 0,
            reads: true,
            read: Vec::new(),
        }
    }

    /// Whether a frame of this run is its first.
    pub(super) fn is_other_run(&self, run: &str) -> bool {
        self.parts == 0 || self.run != run
    }

    /// Whether a part is the one of its group that is read. In each group of two groups one is drawn.
    fn is_read(&self, number: u64) -> bool {
        (1..=self.halvings).all(|halving| {
            let group = number >> halving;
            let drawn = Rng::new(STREAM ^ group.rotate_left(8) ^ u64::from(halving)).bits() & 1;
            (number >> (halving - 1)) & 1 == drawn
        })
    }
}

impl Frames {
    /// Whether the next frame is read.
    pub(super) fn reads_next(&mut self, run: &str, press: i32) -> bool {
        let is_other_run = self.excerpt.is_other_run(run);
        if is_other_run {
            run.clone_into(&mut self.excerpt.run);
            self.excerpt.press = -1;
        }
        let is_other_press = press >= 0 && press != self.excerpt.press;
        let most = self.excerpt.frames_most.div_ceil(PART_SHARE);
        let kept = self.excerpt.read.last().map_or(0, |(_, first)| self.len() - first);
        let is_full = self.excerpt.length >= most as u64 * u64::from(self.excerpt.each)
            || self.excerpt.reads && kept >= most;
        if is_other_run || is_other_press || is_full {
            self.next_part(is_other_run);
        }
        if press >= 0 {
            self.excerpt.press = press;
        }
        self.excerpt.length += 1;
        self.excerpt.reads
    }

    /// Ends a part and begins the next.
    fn next_part(&mut self, is_other_run: bool) {
        let next = self.len();
        let gap = self.way.split_off(self.way.partition_point(|point| point.before < next));
        // Where no frame of a run follows, nobody asks for its way.
        if !is_other_run {
            let at_once = if self.excerpt.each > 1 { POINTS_AT_ONCE } else { usize::MAX };
            self.way.extend(gap.chunks(at_once).flat_map(|some| bends(some, OFF_MM)));
        }
        self.shorten_way();
        let number = self.excerpt.parts;
        self.excerpt.parts += 1;
        self.excerpt.length = 0;
        self.excerpt.reads = self.excerpt.is_read(number);
        if self.excerpt.reads {
            self.excerpt.read.push((number, next));
        }
    }

    /// Notes where the tip is at a frame that is not read.
    pub(super) fn pass(&mut self, t_s: f64, position_mm: [f64; 3], press: i32) {
        self.way.push(WayPoint { before: self.len(), t_s, position_mm, press });
    }

    /// Joins frames or reads fewer parts, if there are too many frames.
    pub(super) fn fit_in(&mut self) {
        while self.len() > self.excerpt.frames_most {
            if self.slow_down() {
                continue;
            }
            self.excerpt.halvings += 1;
            let mut kept = vec![false; self.len()];
            let read = std::mem::take(&mut self.excerpt.read);
            let ends = read.iter().skip(1).map(|(_, first)| *first).chain([self.len()]);
            let mut count = 0;
            for ((number, first), end) in read.iter().zip(ends) {
                if self.excerpt.is_read(*number) {
                    kept[*first..end].fill(true);
                    self.excerpt.read.push((*number, count));
                    count += end - first;
                }
            }
            self.excerpt.reads = self.excerpt.is_read(self.excerpt.parts - 1);
            self.keep(&kept);
            self.shorten_way();
        }
    }

    /// Keeps some of the frames, and of the others the way.
    fn keep(&mut self, kept: &[bool]) {
        let mut old = std::mem::take(&mut self.way).into_iter().peekable();
        let (mut passed, mut way): (Vec<WayPoint>, Vec<WayPoint>) = (Vec::new(), Vec::new());
        let (mut begin, mut count) = (0, 0);
        for (run, end) in std::mem::take(&mut self.runs) {
            let before = count;
            for (frame, kept) in (begin..end).zip(&kept[begin..end]) {
                passed.extend(std::iter::from_fn(|| old.next_if(|point| point.before <= frame)));
                if *kept {
                    way.extend(
                        bends(&passed, OFF_MM).into_iter().map(|point| WayPoint { before: count, ..point }),
                    );
                    passed.clear();
                    count += 1;
                } else {
                    let (t_s, position_mm, press) =
                        (self.t_s[frame], self.position_mm[frame], self.press[frame]);
                    passed.push(WayPoint { before: count, t_s, position_mm, press });
                }
            }
            if end < kept.len() || run != self.excerpt.run {
                passed.clear();
            }
            if count > before {
                self.runs.push((run, count));
            }
            begin = end;
        }
        passed.extend(old);
        way.extend(passed.into_iter().map(|point| WayPoint { before: count, ..point }));
        self.way = way;
        retain(&mut self.number, kept, 1);
        retain(&mut self.press, kept, 1);
        retain(&mut self.phase, kept, 1);
        retain(&mut self.t_s, kept, 1);
        retain(&mut self.position_mm, kept, 1);
        retain(&mut self.covering_mm, kept, 1);
        retain(&mut self.indenter, kept, 1);
        retain(&mut self.temperature_c, kept, 1);
        retain(&mut self.joined, kept, 1);
        retain(&mut self.counts, kept, self.elements);
    }

    /// Forgets the older half of the way before each frame, if it has more points than frames may be read.
    fn shorten_way(&mut self) {
        while self.way.len() > self.excerpt.frames_most {
            let gaps = self.way.chunk_by(|one, next| one.before == next.before);
            self.way = gaps.flat_map(|gap| &gap[gap.len() / 2..]).copied().collect();
        }
    }
}

/// Keeps the values of some frames, of which each has so many.
fn retain<T>(values: &mut Vec<T>, kept: &[bool], each: usize) {
    let mut place = 0;
    values.retain(|_| {
        place += 1;
        kept[(place - 1) / each]
    });
}

#[cfg(test)]
#[path = "excerpt_tests.rs"]
mod tests;
