//! Measured frames, stored by column.

use std::ops::Range;

use tactus_schema::table::{Phase, RowView};

use super::excerpt::Excerpt;
use super::motion::load_speed_mm_per_s;
use super::way::WayPoint;

/// Frames of one or more runs, stored by column. Memory and time are bounded: of a long recording of a fast sensor each frame is the mean of some
/// ([`Frames::joined`]), and of a longer one only whole presses from all of it are there ([`Frames::left_out`]).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frames {
    pub(crate) elements: usize,
    /// Ids of the runs, and the frame after each one's last.
    pub(crate) runs: Vec<(String, usize)>,
    /// Ids of the indenters.
    pub(crate) indenters: Vec<String>,
    pub(crate) press: Vec<i32>,
    pub(crate) phase: Vec<Phase>,
    /// Time since the run's first frame.
    pub(crate) t_s: Vec<f64>,
    pub(crate) position_mm: Vec<[f64; 3]>,
    pub(crate) covering_mm: Vec<f64>,
    /// Index in `indenters`.
    pub(crate) indenter: Vec<u16>,
    /// NaN where it was not measured.
    pub(crate) temperature_c: Vec<f32>,
    /// Row-major: frame by frame, element by element.
    pub(crate) counts: Vec<f32>,
    /// The tip's way where frames are left out.
    pub(super) way: Vec<WayPoint>,
    /// The place of each frame among those that were given; of some that were joined, that of their first.
    pub(super) number: Vec<u64>,
    /// How many frames that were given each is the mean of.
    pub(super) joined: Vec<u32>,
    pub(super) given: u64,
    pub(super) excerpt: Excerpt,
    first_ns: i64,
}

/// A moment of a run: that of a frame, or of a frame that is left out.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OnWay {
    pub(crate) frame: Option<usize>,
    pub(crate) t_s: f64,
    pub(crate) position_mm: [f64; 3],
    pub(crate) press: i32,
}

impl Frames {
    /// No frames yet, of an array with this number of elements.
    pub fn new(elements: usize) -> Self {
        Self { elements, excerpt: Excerpt::of_elements(elements), ..Self::default() }
    }

    /// Adds the next frame.
    ///
    /// # Panics
    /// If the frame does not have one count per element.
    pub fn push(&mut self, frame: RowView<'_>) {
        assert_eq!(frame.counts.len(), self.elements, "one count per element");
        if self.excerpt.is_other_run(frame.run) {
            self.first_ns = frame.t_ns;
        }
        let t_s = (frame.t_ns - self.first_ns) as f64 * 1e-9;
        let reads = self.reads_next(frame.run, frame.press);
        self.given += 1;
        if !reads {
            self.pass(t_s, frame.position_mm, frame.press);
            return;
        }
        if self.runs.last().is_none_or(|(run, _)| run != frame.run) {
            self.runs.push((frame.run.to_owned(), self.len()));
        }
        let known = self.indenters.iter().position(|known| known == frame.indenter);
        let indenter = known.unwrap_or_else(|| {
            self.indenters.push(frame.indenter.to_owned());
            self.indenters.len() - 1
        });
        self.press.push(frame.press);
        self.phase.push(frame.phase);
        self.t_s.push(t_s);
        self.number.push(self.given - 1);
        self.joined.push(1);
        self.position_mm.push(frame.position_mm);
        self.covering_mm.push(frame.covering_mm);
        self.indenter.push(u16::try_from(indenter).unwrap_or(u16::MAX));
        self.temperature_c.push(frame.temperature_c.map_or(f32::NAN, |c| {
            #[expect(clippy::cast_possible_truncation, reason = "a temperature needs no more digits")]
            let single = c as f32;
            single
        }));
        self.counts.extend_from_slice(frame.counts);
        if let Some((_, end)) = self.runs.last_mut() {
            *end += 1;
        }
        if self.excerpt.each > 1 {
            // This one may join the last before it, which otherwise is complete and may join the one before that.
            self.join(self.len().saturating_sub(3));
        }
        self.fit_in();
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// True if there is no frame.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// How many frames were given.
    pub const fn given(&self) -> u64 {
        self.given
    }

    /// How many of the frames that were given are not there, nor joined to others.
    pub fn left_out(&self) -> u64 {
        self.given - self.joined.iter().map(|joined| u64::from(*joined)).sum::<u64>()
    }

    /// For each frame, its place among those that were given; of some that were joined, that of the one in their middle.
    pub fn numbers(&self) -> impl Iterator<Item = u64> {
        self.number.iter().zip(&self.joined).map(|(number, joined)| number + u64::from((joined - 1) / 2))
    }

    /// The tip's way between a frame and the one before, as far as frames are left out there.
    pub(crate) fn way_to(&self, frame: usize) -> &[WayPoint] {
        let from = self.way.partition_point(|point| point.before < frame);
        let count = self.way[from..].partition_point(|point| point.before == frame);
        &self.way[from..from + count]
    }

    /// True if frames are left out directly before a frame.
    pub(crate) fn is_after_gap(&self, frame: usize) -> bool {
        !self.way_to(frame).is_empty()
    }

    /// The moments of some frames and of those that are left out before them.
    pub(crate) fn on_way(&self, frames: Range<usize>) -> impl Iterator<Item = OnWay> {
        frames.flat_map(|frame| {
            let left_out = self.way_to(frame).iter().map(|point| OnWay {
                frame: None,
                t_s: point.t_s,
                position_mm: point.position_mm,
                press: point.press,
            });
            left_out.chain([OnWay {
                frame: Some(frame),
                t_s: self.t_s[frame],
                position_mm: self.position_mm[frame],
                press: self.press[frame],
            }])
        })
    }

    /// The speed at which presses are loaded; none if no load has two frames.
    pub fn load_speed_mm_per_s(&self) -> Option<f64> {
        load_speed_mm_per_s(self)
    }

    /// The frames as rows of the measurement table, in order; the time is since the run's first frame.
    pub(crate) fn rows(&self) -> impl Iterator<Item = RowView<'_>> {
        let mut run = 0;
        (0..self.len()).map(move |frame| {
            while self.runs[run].1 <= frame {
                run += 1;
            }
            #[expect(clippy::cast_possible_truncation, reason = "a whole number of nanoseconds before")]
            let t_ns = (self.t_s[frame] * 1e9).round() as i64;
            RowView {
                run: &self.runs[run].0,
                press: self.press[frame],
                phase: self.phase[frame],
                t_ns,
                position_mm: self.position_mm[frame],
                covering_mm: self.covering_mm[frame],
                indenter: &self.indenters[usize::from(self.indenter[frame])],
                temperature_c: Some(f64::from(self.temperature_c[frame])).filter(|c| c.is_finite()),
                counts: self.counts_of(frame),
            }
        })
    }

    /// The counts of a frame, row-major.
    pub(crate) fn counts_of(&self, frame: usize) -> &[f32] {
        &self.counts[frame * self.elements..(frame + 1) * self.elements]
    }

    /// The mean of each element's counts over some frames.
    pub(super) fn mean_counts(&self, among: Range<usize>) -> Vec<f64> {
        let mut means = vec![0.0; self.elements];
        let count = among.len() as f64;
        for frame in among {
            for (mean, counts) in means.iter_mut().zip(self.counts_of(frame)) {
                *mean += f64::from(*counts) / count;
            }
        }
        means
    }
}
