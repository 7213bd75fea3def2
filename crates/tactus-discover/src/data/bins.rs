//! Bins of frames: where the tip rests, or goes slowly straight on in contact ([`super::slow_ways`]), consecutive frames are averaged into one bin.
//!
//! Another frame in motion is a bin of its own. Once the tip rests, each bin holds more frames than the one before, up to half a
//! second, so bins are short where relaxation is fast. So it is on a slow way, on which a bin reaches only so far, too.

use tactus_model::Trajectory;

use super::error::{DiscoverError, Mismatch};
use super::frames::Frames;
use super::motion::{CLEAR_MM, interval_s, pressing, turns, unchanged};
use super::noise::Noise;
use super::slow_ways::SlowWays;
use crate::numbers::{Rng, StraightLine};

/// Greatest number of frames in a bin, as a share of the frames since the tip came to rest, or on its way.
const GROWTH: f64 = 0.25;
/// Greatest number of frames in a bin.
const FRAMES_MAX: usize = 15;
/// Least number of frames of a bin at rest, if it has several: what a mean loses of fewer nobody can tell ([`Bins::averaged_out`]).
const REST_LEAST: usize = 3;
/// Least duration of a block. Readings of different blocks are taken to be independent.
const BLOCK_S: f64 = 3.0;
/// Longest stretch of rest that is fitted or held out as a unit.
const STRETCH_S: f64 = 10.0;
/// One press in this many is held out.
const HELDOUT_ONE_IN: usize = 3;
/// All presses of one value are held out if there are so many different ones: two on either side, or nearly.
const SETTINGS_LEAST: usize = 4;
/// A value that occurs so many times is a setting.
const OFTEN: usize = 4;
/// So many presses are held out, even where a run has no other press: fewer have no bound of what is structured in them.
const JUDGED_LEAST: usize = 3;

/// Bins in order of time, run by run.
#[derive(Debug)]
pub(crate) struct Bins {
    pub(crate) elements: usize,
    /// First frame of each bin; one more entry holds the number of frames.
    pub(crate) first: Vec<usize>,
    pub(crate) run: Vec<usize>,
    /// Mean time of the bin's frames since the run's first frame.
    pub(crate) t_s: Vec<f64>,
    /// True for bins of several frames in which the tip moves.
    pub(crate) moves: Vec<bool>,
    /// Mean counts, bin by bin; none of bins that are only predicted.
    pub(crate) counts: Vec<f64>,
    /// Inverse variance of a bin's mean for a noise of one count; 0 for bins that are ignored.
    pub(crate) weight: Vec<f64>,
    /// Block of each bin. Bins of one block may be dependent, blocks are independent.
    pub(crate) block: Vec<usize>,
    pub(crate) blocks: usize,
    /// True for bins that are not fitted.
    pub(crate) heldout: Vec<bool>,
    /// Path of the tip in each run.
    pub(crate) paths: Vec<Trajectory>,
}

/// Which frames bins hold several of.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Averaged<'a> {
    /// None.
    None,
    /// Those in which the tip rests.
    Rests,
    /// These, and those in which it goes slowly straight on in a contact that readings with this noise show.
    RestsAndSlowWays(&'a Noise),
}

/// The held-out part of the data.
#[derive(Debug, Clone, Default)]
pub(crate) struct HeldOut {
    /// Whether each frame is held out.
    pub(crate) frames: Vec<bool>,
    pub(crate) train_presses: usize,
    pub(crate) presses: usize,
    pub(crate) depths_mm: Vec<f64>,
    pub(crate) coverings_mm: Vec<f64>,
}

impl Bins {
    /// Bins of the frames; not weighted yet.
    pub(crate) fn of(frames: &Frames, averaged: Averaged<'_>) -> Result<Self, DiscoverError> {
        let mut bins = Self::divided(frames, averaged)?;
        bins.counts = bins.first.windows(2).flat_map(|of| frames.mean_counts(of[0]..of[1])).collect();
        Ok(bins)
    }

    /// Bins of one frame each to be predicted, without counts.
    pub(crate) fn of_frames(frames: &Frames) -> Result<Self, DiscoverError> {
        Self::divided(frames, Averaged::None)
    }

    fn divided(frames: &Frames, averaged: Averaged<'_>) -> Result<Self, DiscoverError> {
        let unchanged = unchanged(frames, CLEAR_MM);
        let ways = match averaged {
            Averaged::RestsAndSlowWays(noise) => SlowWays::of(frames, noise),
            Averaged::None | Averaged::Rests => SlowWays::none(frames),
        };
        let (mut first, mut run, mut t_s, mut moves) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut begin = 0;
        let mut paths = Vec::new();
        for (index, (_, end)) in frames.runs.iter().enumerate() {
            paths.push(path(frames, begin, *end)?);
            let mut frame = begin;
            while frame < *end {
                let is_way = ways.since(frame) > unchanged[frame];
                let since = if is_way { ways.since(frame) } else { unchanged[frame] };
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number")]
                let most = match averaged {
                    Averaged::None => 1,
                    Averaged::Rests | Averaged::RestsAndSlowWays(_) => {
                        ((GROWTH * since as f64) as usize).clamp(1, FRAMES_MAX)
                    }
                };
                let goes_on = |next: usize| {
                    if is_way {
                        ways.reaches(frames, frame, next)
                    } else {
                        unchanged[next] > unchanged[next - 1]
                    }
                };
                let mut next = frame + 1;
                while next < *end
                    && next - frame < most
                    && goes_on(next)
                    && pressing(frames.phase[next]) == pressing(frames.phase[frame])
                {
                    next += 1;
                }
                if !is_way && next - frame < REST_LEAST {
                    next = frame + 1;
                }
                first.push(frame);
                run.push(index);
                moves.push(is_way && next - frame > 1);
                let count = (next - frame) as f64;
                t_s.push(frames.t_s[frame..next].iter().sum::<f64>() / count);
                frame = next;
            }
            begin = *end;
        }
        let bins = run.len();
        first.push(frames.len());
        Ok(Self {
            elements: frames.elements,
            first,
            run,
            t_s,
            moves,
            counts: Vec::new(),
            weight: vec![1.0; bins],
            block: vec![0; bins],
            blocks: 1,
            heldout: vec![false; bins],
            paths,
        })
    }

    pub(crate) fn len(&self) -> usize {
        self.run.len()
    }

    /// Number of frames in a bin.
    pub(crate) fn frames_in(&self, bin: usize) -> usize {
        self.first[bin + 1] - self.first[bin]
    }

    /// Where the tip was in the middle of a bin; robot frame.
    pub(crate) fn position_mm(&self, frames: &Frames, bin: usize) -> [f64; 3] {
        if self.moves[bin] {
            self.paths[self.run[bin]].at(self.t_s[bin])
        } else {
            frames.position_mm[self.first[bin]]
        }
    }

    /// By how much what was predicted of an element at a frame of a bin differs from what was predicted of the bin, per second: as from the bin before
    /// to it, if the tip moves in it.
    pub(crate) fn slope_per_s(&self, predicted: &[f64], bin: usize, element: usize) -> f64 {
        if !self.moves[bin] {
            return 0.0;
        }
        // The bin before is on the same way, because a bin has several frames only after some. After it the tip may do anything.
        let before = bin - 1;
        let of = |bin: usize| predicted[bin * self.elements + element];
        (of(bin) - of(before)) / (self.t_s[bin] - self.t_s[before])
    }

    /// What the bins' means do not have of values of the frames: the departures from a straight line through those of a bin, frame by frame, element
    /// by element. A slope is left to the means, because the next bin goes on with it.
    pub(crate) fn averaged_out(&self, mut values: Vec<f64>) -> Vec<f64> {
        let elements = self.elements;
        for of_bin in self.first.windows(2).map(|frames| frames[0]..frames[1]) {
            for element in 0..elements {
                let reading = |frame: usize| frame * elements + element;
                let line = StraightLine::through(of_bin.clone().map(|frame| values[reading(frame)]));
                for (place, frame) in of_bin.clone().enumerate() {
                    values[reading(frame)] -= line.at(place);
                }
            }
        }
        values
    }

    /// True if the tip was clear of the surface.
    pub(crate) fn is_clear(&self, frames: &Frames, bin: usize) -> bool {
        frames.position_mm[self.first[bin]][2] > CLEAR_MM
    }

    /// Sets the bins' weights from the noise, and divides them into blocks.
    pub(crate) fn weigh(&mut self, frames: &Frames, noise: &Noise, heldout: &HeldOut) {
        let interval_s = interval_s(frames);
        let (turns, shares) = (turns(frames), frames.shares());
        let block_s = BLOCK_S.max(10.0 * noise.memory_frames() as f64 * interval_s);
        let mut block = 0;
        let mut began = 0;
        for bin in 0..self.len() {
            let (frame, start) = (self.first[bin], self.first[began]);
            self.heldout[bin] = heldout.frames[frame];
            let count = self.frames_in(bin);
            let members = self.first[bin]..self.first[bin + 1];
            // That of a mean of frames which are means themselves.
            let counts =
                (count as f64).powi(2) / shares[members].iter().map(|share| share.recip()).sum::<f64>();
            let whole = counts / noise.inflation(count);
            self.weight[bin] = if turns[frame] { 0.0 } else { whole };
            let other = self.run[bin] != self.run[began]
                || frames.press[frame] != frames.press[start]
                || heldout.frames[frame] != heldout.frames[start]
                || self.t_s[bin] - self.t_s[began] > block_s;
            if other {
                block += 1;
                began = bin;
            }
            self.block[bin] = block;
        }
        self.blocks = block + 1;
    }
}

impl HeldOut {
    /// Holds out one press in three with the rest that follows it. If the data have several coverings, or else several depths,
    /// all presses of one of them are held out, if these are no more than a third. Each run keeps a press and its zeros, as long as there are others
    /// to hold out.
    pub(crate) fn choose(frames: &Frames, seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        let presses = PressSpan::of(frames);
        let mut order: Vec<usize> = (0..presses.len()).collect();
        rng.shuffle(&mut order);
        let wanted = presses.len() / HELDOUT_ONE_IN;
        let (mut depths_mm, mut coverings_mm) = (Vec::new(), Vec::new());
        // One in the middle: outside the fitted range even the true model may look wrong.
        if let Some(covering_mm) = middle(&presses, |press| press.covering_mm) {
            coverings_mm.push(covering_mm);
        } else if let Some(depth_mm) = middle(&presses, |press| press.depth_mm) {
            depths_mm.push(depth_mm);
        }
        let is_of = |press: &PressSpan| {
            coverings_mm.iter().any(|one| same(*one, press.covering_mm))
                || depths_mm.iter().any(|one| same(*one, press.depth_mm))
        };
        let mut out: Vec<bool> = presses.iter().map(is_of).collect();
        let mut held = out.iter().filter(|out| **out).count();
        let mut fitted = vec![0_usize; frames.runs.len()];
        for (press, _) in presses.iter().zip(&out).filter(|(_, out)| !**out) {
            fitted[press.run] += 1;
        }
        // Each run has a gain and zeros of its own, which a press of it has to show. Where that leaves hardly any press to judge by, some runs are
        // judged without.
        for (least, kept) in [(wanted, 1), (wanted.min(JUDGED_LEAST), 0)] {
            for index in &order {
                let of_run = &mut fitted[presses[*index].run];
                if held < least && !out[*index] && *of_run > kept {
                    out[*index] = true;
                    *of_run -= 1;
                    held += 1;
                }
            }
        }
        let mut of_frame = vec![false; frames.len()];
        for (press, out) in presses.iter().zip(&out) {
            of_frame[press.first..press.end].fill(*out);
        }
        rests(frames, &presses, &mut rng, &mut of_frame);
        zeros(frames, &mut of_frame);
        Self { frames: of_frame, train_presses: presses.len() - held, presses: held, depths_mm, coverings_mm }
    }
}

/// Number of presses of all runs.
pub(crate) fn presses(frames: &Frames) -> usize {
    PressSpan::of(frames).len()
}

/// Frames of a press and of the rest after it, up to the next press or [`STRETCH_S`].
pub(super) struct PressSpan {
    run: usize,
    pub(super) first: usize,
    pub(super) end: usize,
    pub(super) depth_mm: f64,
    covering_mm: f64,
}

impl PressSpan {
    pub(super) fn of(frames: &Frames) -> Vec<Self> {
        let mut presses: Vec<Self> = Vec::new();
        let mut begin = 0;
        for (run, (_, run_end)) in frames.runs.iter().enumerate() {
            let mut last: Option<i32> = None;
            let mut left_s = f64::NEG_INFINITY;
            for frame in begin..*run_end {
                let press = frames.press[frame];
                if press >= 0 {
                    if last != Some(press) {
                        let covering_mm = frames.covering_mm[frame];
                        let end = frame + 1;
                        presses.push(Self { run, first: frame, end, depth_mm: 0.0, covering_mm });
                        last = Some(press);
                    }
                    left_s = frames.t_s[frame];
                }
                let belongs = press >= 0 || frames.t_s[frame] - left_s <= STRETCH_S;
                if let Some(current) = presses.last_mut().filter(|_| last.is_some() && belongs) {
                    current.end = frame + 1;
                    current.depth_mm = current.depth_mm.max(-frames.position_mm[frame][2]);
                }
            }
            begin = *run_end;
        }
        presses
    }
}

/// Holds out one stretch in three of the frames that belong to no press.
fn rests(frames: &Frames, presses: &[PressSpan], rng: &mut Rng, out: &mut [bool]) {
    let mut taken = vec![false; frames.len()];
    for press in presses {
        taken[press.first..press.end].fill(true);
    }
    let mut stretch: Option<(f64, bool)> = None;
    let mut run = frames.runs.iter().map(|(_, end)| *end).peekable();
    for frame in 0..frames.len() {
        if run.next_if(|end| *end <= frame).is_some() || taken[frame] {
            stretch = None;
        }
        if taken[frame] {
            continue;
        }
        let t_s = frames.t_s[frame];
        let (_, held) = *match &mut stretch {
            Some(begun) if t_s - begun.0 <= STRETCH_S => begun,
            other => other.insert((t_s, rng.below(HELDOUT_ONE_IN) == 0)),
        };
        out[frame] = held;
    }
}

/// Has the runs that would have no fitted frame in the clear, which shows their zeros, fitted wherever they have frames in the clear without a
/// press.
fn zeros(frames: &Frames, out: &mut [bool]) {
    let mut begin = 0;
    for (_, end) in &frames.runs {
        let is_clear = |frame: &usize| frames.position_mm[*frame][2] > CLEAR_MM;
        if !(begin..*end).any(|frame| is_clear(&frame) && !out[frame]) {
            for frame in (begin..*end).filter(|frame| is_clear(frame) && frames.press[*frame] < 0) {
                out[frame] = false;
            }
        }
        begin = *end;
    }
}

/// The middle one of at least four different values, if they occur four times in the mean. If it is that of more than a third of the presses, so
/// that too few would be fitted, or of all presses of a run, the nearest one to it of which neither is true, and which occurs four times at least.
/// The ends are never chosen.
fn middle(presses: &[PressSpan], value: impl Fn(&PressSpan) -> f64) -> Option<f64> {
    let mut values: Vec<f64> = presses.iter().map(&value).collect();
    values.sort_by(f64::total_cmp);
    values.dedup_by(|a, b| same(*a, *b));
    // Values that scatter are no distinct settings.
    if values.len() < SETTINGS_LEAST || presses.len() < OFTEN * values.len() {
        return None;
    }
    let has = |place: usize| {
        let (values, value) = (&values, &value);
        move |press: &&PressSpan| same(values[place], value(press))
    };
    let count = |place: usize| presses.iter().filter(has(place)).count();
    let leaves_enough = |place: &usize| {
        let mut of_runs = presses.chunk_by(|one, next| one.run == next.run);
        count(*place) <= presses.len() / HELDOUT_ONE_IN
            && of_runs.all(|of_run| !of_run.iter().all(|press| has(*place)(&press)))
    };
    let middle = values.len() / 2;
    if leaves_enough(&middle) {
        return Some(values[middle]);
    }
    let others = (1..values.len() - 1).filter(|place| leaves_enough(place) && count(*place) >= OFTEN);
    others.min_by_key(|place| place.abs_diff(middle)).map(|place| values[place])
}

fn same(one: f64, other: f64) -> bool {
    (one - other).abs() < 0.005
}

fn path(frames: &Frames, begin: usize, end: usize) -> Result<Trajectory, DiscoverError> {
    let mut last_s = f64::NEG_INFINITY;
    let points = frames.on_way(begin..end).filter_map(|one| {
        let rises = one.t_s > last_s;
        last_s = last_s.max(one.t_s);
        rises.then_some((one.t_s, one.position_mm))
    });
    Ok(Trajectory::new(points).map_err(Mismatch::Path)?)
}

#[cfg(test)]
#[path = "bins_tests.rs"]
mod tests;
