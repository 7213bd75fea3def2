//! The converter as its readings show it: coarser than declared, or with codes that it never gives.
//!
//! Means do not show this, nor do residuals if noise dithers; single readings do.
//!
//! - **Wider steps.** The probability that `n` different readings lie on a lattice of `q` declared steps by chance is `(1 / q)^(n - 4)`: the ends of the
//!   range need not lie on it, one is its origin and one says its step.
//! - **Gaps.** An element whose readings go from one side of a gap of `w` counts to the other by `d` counts from frame to frame would
//!   have been read inside with a probability of `w / d`, had the converter those codes. What belongs there is read as a code at one of its
//!   ends, which then is more frequent than its neighbours; without that it is a jump of the signal, and no gap of codes.
//!
//! Rounding to such codes repeats where signals do, so that it is no noise; [`Rounding`] takes it out of readings whose signal a model knows:
//! what it does in the mean is subtracted, so that what the model lacks stays.
//!
//! # Source
//! Frequencies of codes: IEEE Std 1241-2010, *Terminology and Test Methods for Analog-to-Digital Converters*, section 4.7.

use std::collections::{BTreeMap, BTreeSet};

use super::frames::Frames;
use crate::numbers::upper_tail;

/// Least number of different readings; fewer may lie on a lattice by chance.
const READINGS_LEAST: usize = 20;
/// Least ratio of the lattice's step to the declared one.
const WIDER: f64 = 1.4;
/// Greatest distance of a reading from the lattice, as a share of a step.
const OFF_MAX: f64 = 0.02;
/// Readings are rounded by at most so much of a step; a step that is nearly lost in that is not seen.
pub(super) const ROUNDED_MAX: f64 = 0.08;
/// Up to here single precision has all whole numbers.
const WHOLE_MAX: f64 = 16_777_216.0;
/// Gaps that are looked at, at most; with more, readings are too few to show codes.
const GAPS_MAX: usize = 512;
/// A code at the end of a gap has at least so many readings.
const AT_END_LEAST: usize = 10;
/// A gap has at most this probability by chance, times the number of those looked at.
const CHANCE: f64 = 1e-6;
/// After that, no more crossings of a gap are counted.
const LN_ENOUGH: f64 = -100.0;
/// No single crossing says more than this: readings jitter in time.
const SEEN_MOST: f64 = 0.9;
/// The codes beside a gap that tell how frequent a code is there.
const BESIDE: usize = 8;
/// Share of what a gap lacks that its ends have too much, at least.
const PILED_LEAST: f64 = 0.5;
/// Noise reaches so many standard deviations.
const FAR: f64 = 6.0;

/// A converter that is not as declared.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Converter {
    pub(crate) fault: Fault,
    /// The probability that a converter as declared gives such readings.
    pub(crate) p_value: f64,
}

/// What is wrong with a converter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fault {
    /// Its step is wider: so many counts.
    WiderSteps(f64),
    /// Codes are missing.
    Gaps(Vec<Gap>),
}

/// Codes that a converter never gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gap {
    /// The codes before and after it.
    pub(crate) ends: [f64; 2],
    /// The share of it, from below, that is read as the code before.
    pub(crate) low_share: f64,
}

impl Converter {
    /// How the converter of these readings differs from one of the declared step, if they show it.
    pub(crate) fn seen(frames: &Frames, declared_counts: f64) -> Option<Self> {
        // Means lie on no lattice, or on one of their own.
        if frames.joined() > 1 {
            return None;
        }
        let codes = Frequencies::of(&frames.counts);
        codes.wider_steps(declared_counts).or_else(|| codes.gaps(frames, declared_counts))
    }

    /// The step of the lattice on which all readings lie, 0 if they lie on none. `None` if there are too few different ones to tell.
    pub(super) fn step_of(readings: &[f32]) -> Option<f64> {
        let codes = Frequencies::of(readings).counts;
        // The ends of the range need not be a whole number of steps apart from the others.
        let inside = || codes.get(1..codes.len() - 1).and_then(lattice_step).unwrap_or(0.0);
        (codes.len() >= READINGS_LEAST).then(inside)
    }

    /// True if its steps are wider than declared.
    pub(crate) const fn rounds(&self) -> bool {
        matches!(self.fault, Fault::WiderSteps(_))
    }

    /// The step of its readings.
    pub(crate) const fn step_counts(&self, declared_counts: f64) -> f64 {
        match self.fault {
            Fault::WiderSteps(step_counts) => step_counts,
            Fault::Gaps(_) => declared_counts,
        }
    }
}

/// The different readings, rising, and how often each occurs.
struct Frequencies {
    counts: Vec<f64>,
    times: Vec<usize>,
}

impl Frequencies {
    fn of(readings: &[f32]) -> Self {
        let mut times: BTreeMap<u32, usize> = BTreeMap::new();
        for counts in readings.iter().filter(|counts| counts.is_finite()) {
            // Zero has two signs.
            *times.entry((counts + 0.0).to_bits()).or_default() += 1;
        }
        let mut all: Vec<(f64, usize)> =
            times.into_iter().map(|(bits, times)| (f64::from(f32::from_bits(bits)), times)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (counts, times) = all.into_iter().unzip();
        Self { counts, times }
    }

    fn wider_steps(&self, declared_counts: f64) -> Option<Converter> {
        let readings = &self.counts;
        if readings.len() < READINGS_LEAST {
            return None;
        }
        // The ends of the range need not be a whole number of steps apart from the others.
        let step = lattice_step(&readings[1..readings.len() - 1])?;
        (step >= WIDER * declared_counts.max(f64::MIN_POSITIVE)).then(|| {
            let chance = (declared_counts / step).max(1e-3).powf(readings.len() as f64 - 4.0);
            Converter { fault: Fault::WiderSteps(step), p_value: chance.max(f64::MIN_POSITIVE) }
        })
    }

    fn gaps(&self, frames: &Frames, declared_counts: f64) -> Option<Converter> {
        if declared_counts <= 0.0 {
            return None;
        }
        let apart = |low: usize| (self.counts[low + 1] - self.counts[low]) / declared_counts;
        // Where readings are few, or repeat without noise, the codes beside its ends are not given either.
        let is_wide = |low: &usize| apart(*low) > 1.0 + WIDER && apart(low - 1).max(apart(low + 1)) < WIDER;
        let is_frequent = |low: &usize| self.times[*low].max(self.times[low + 1]) >= AT_END_LEAST;
        let places = 1..self.counts.len().saturating_sub(2);
        let wide: Vec<usize> = places.filter(is_wide).filter(is_frequent).collect();
        if wide.is_empty() || wide.len() > GAPS_MAX {
            return None;
        }
        let ends: Vec<[f64; 2]> = wide.iter().map(|low| [self.counts[*low], self.counts[low + 1]]).collect();
        let ln_chances = ln_chances(frames, &ends, declared_counts);
        let ln_most = (CHANCE / ends.len() as f64).ln();
        let found = wide.iter().zip(&ends).zip(&ln_chances).filter(|(_, chance)| **chance <= ln_most);
        let gaps: Vec<(Gap, f64)> = found
            .filter_map(|((low, ends), ln_chance)| {
                let low_share = self.low_share(*low, ends[1] - ends[0] - declared_counts, declared_counts)?;
                Some((Gap { ends: *ends, low_share }, *ln_chance))
            })
            .collect();
        let least = gaps.iter().map(|(_, ln_chance)| *ln_chance).fold(0.0, f64::min);
        let p_value = (least + (ends.len() as f64).ln()).exp().max(f64::MIN_POSITIVE);
        let gaps: Vec<Gap> = gaps.into_iter().map(|(gap, _)| gap).collect();
        (!gaps.is_empty()).then_some(Converter { fault: Fault::Gaps(gaps), p_value })
    }

    /// The share of a gap, `missing_counts` wide, that is read as the code before it; `None` if its ends have no more readings than the codes
    /// beside them.
    fn low_share(&self, low: usize, missing_counts: f64, step_counts: f64) -> Option<f64> {
        let beside: usize = (low.saturating_sub(BESIDE)..low)
            .chain(low + 2..(low + 2 + BESIDE).min(self.times.len()))
            .map(|code| self.times[code])
            .sum();
        let reach = |from: usize, to: usize| self.counts[to] - self.counts[from];
        let first = low.saturating_sub(BESIDE);
        let last = (low + 1 + BESIDE).min(self.times.len() - 1);
        let codes = (reach(first, low) + reach(low + 1, last)) / step_counts;
        let usual = beside as f64 / codes.max(1.0);
        let [before, after] = [low, low + 1].map(|code| (self.times[code] as f64 - usual).max(0.0));
        let piled = before + after;
        (piled > PILED_LEAST * usual * missing_counts / step_counts).then(|| before / piled)
    }
}

/// True if readings that are rounded by so much may be a whole number of steps apart.
pub(super) fn is_whole(apart_counts: f64, step_counts: f64, rounding_counts: f64) -> bool {
    let steps = apart_counts / step_counts;
    (steps - steps.round()).abs() * step_counts <= OFF_MAX * step_counts + rounding_counts
}

/// True if single precision has a reading as it was.
pub(super) fn is_exact(reading: f64) -> bool {
    reading.fract() == 0.0 && reading.abs() <= WHOLE_MAX
}

/// The step of a lattice on which all of these rising readings lie, if they lie on one.
///
/// In a unit in which a step is no binary fraction each reading is rounded, so that a difference of two says the step only nearly. The smallest
/// differences are surely one step each or a few; what they say together tells how many steps a greater one has, and so on.
fn lattice_step(readings: &[f64]) -> Option<f64> {
    let (first, last) = (*readings.first()?, *readings.last()?);
    let are_exact = readings.iter().all(|reading| is_exact(*reading));
    let rounding = if are_exact { 0.0 } else { last.abs().max(first.abs()) * f64::from(f32::EPSILON) };
    let mut apart: Vec<f64> = readings.windows(2).map(|pair| pair[1] - pair[0]).collect();
    apart.sort_by(f64::total_cmp);
    let (mut sum, mut steps) = (0.0, 0.0);
    for one in apart {
        let step = if steps > 0.0 { sum / steps } else { one };
        if rounding > ROUNDED_MAX * step {
            return None;
        }
        sum += one;
        steps += (one / step).round();
    }
    let step = sum / steps;
    let is_on = |reading: &f64| is_whole(reading - first, step, rounding);
    (steps > 0.0 && readings.iter().all(is_on)).then_some(step)
}

/// For each gap, the logarithm of the probability that no reading is inside, had the converter those codes: of an element the first crossing in
/// each press and in each rest between presses. Crossings between the same two codes say the same where nothing dithers, and count once.
fn ln_chances(frames: &Frames, ends: &[[f64; 2]], step_counts: f64) -> Vec<f64> {
    let elements = frames.elements;
    let mut ln_chances = vec![0.0; ends.len()];
    let mut crossed: Vec<Option<i32>> = vec![None; ends.len() * elements];
    let mut counted = BTreeSet::new();
    let mut begin = 0;
    for (_, end) in &frames.runs {
        crossed.fill(None);
        for frame in begin + 1..*end {
            let press = frames.press[frame];
            let pairs = frames.counts_of(frame - 1).iter().zip(frames.counts_of(frame));
            for (element, (before, now)) in pairs.enumerate() {
                let (low, high) = (f64::from(before.min(*now)), f64::from(before.max(*now)));
                let first = ends.partition_point(|gap| gap[0] < low);
                for gap in (first..ends.len()).take_while(|gap| ends[*gap][1] <= high) {
                    let last = &mut crossed[gap * elements + element];
                    if *last == Some(press) || ln_chances[gap] < LN_ENOUGH {
                        continue;
                    }
                    *last = Some(press);
                    if counted.insert((gap, element, before.to_bits(), now.to_bits())) {
                        let missing = ends[gap][1] - ends[gap][0] - step_counts;
                        ln_chances[gap] += (-(missing / (high - low)).min(SEEN_MOST)).ln_1p();
                    }
                }
            }
        }
        begin = *end;
    }
    ln_chances
}

/// What a converter that is not as declared does to readings.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rounding {
    /// The counts that it gives, rising.
    given: Vec<f64>,
    /// The input from which on each but the first is given.
    begins: Vec<f64>,
}

impl Rounding {
    /// That of a converter which gave these readings. A code begins in the middle between it and the one before, or in a gap where it is read.
    pub(crate) fn of(converter: &Converter, readings: &[f32]) -> Self {
        let given = Frequencies::of(readings).counts;
        let gaps = match &converter.fault {
            Fault::WiderSteps(_) => &[],
            Fault::Gaps(gaps) => &gaps[..],
        };
        let begin = |pair: &[f64]| {
            let gap = gaps.iter().find(|gap| gap.ends[0].total_cmp(&pair[0]).is_eq());
            pair[0] + gap.map_or(0.5, |gap| gap.low_share) * (pair[1] - pair[0])
        };
        let begins = given.windows(2).map(begin).collect();
        Self { given, begins }
    }

    /// A reading less what the converter does, in the mean, to an expected input with normal noise, all in counts.
    pub(crate) fn without(&self, reading: f64, expected: f64, noise_counts: f64) -> f64 {
        reading - (self.mean(expected, noise_counts) - expected)
    }

    /// The mean reading of an input with normal noise.
    fn mean(&self, counts: f64, noise_counts: f64) -> f64 {
        let Self { given, begins } = self;
        let reach = FAR * noise_counts;
        let first = begins.partition_point(|begin| *begin < counts - reach);
        let Some(lowest) = given.get(first) else { return counts };
        let steps = begins[first..].iter().zip(&given[first..]).zip(&given[first + 1..]);
        let within = steps.take_while(|((begin, _), _)| **begin <= counts + reach);
        let above = |begin: f64| {
            if noise_counts > 0.0 {
                upper_tail((begin - counts) / noise_counts)
            } else {
                f64::from(u8::from(begin <= counts))
            }
        };
        lowest + within.map(|((begin, low), high)| (high - low) * above(*begin)).sum::<f64>()
    }
}

#[cfg(test)]
#[path = "converter_tests.rs"]
mod tests;
