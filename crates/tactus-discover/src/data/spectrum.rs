//! Lines in the spectrum of the residual, such as interference from the mains.
//!
//! Frames without contact are used, or those of the tip at rest in contact. The presses interrupt both, so slow changes also have lines at the
//! rhythm of the presses. Lines at which this rhythm itself has one are ignored.
//!
//! A tone is looked for in two ways. What all elements have together, from column to column a phase later, stands out of the sum
//! over elements by their number, so that a tone far below the noise of an element is seen: for each of some phases the columns are summed
//! against it. Where it has another phase in each element, only the sum of their powers tells it.

use std::f64::consts::{LN_2, TAU};
use std::ops::Range;

use tactus_model::effect::{By, Table};

use super::frames::Frames;
use super::motion::{interval_s, still};
use crate::numbers::{NORMAL_PER_MEDIAN, median};

/// Least height of a line of the summed powers above the surrounding ones, in units of their scatter. The sum over elements with
/// independent noise scatters less.
const STANDS_OUT: f64 = 8.0;
/// One of so many recordings of noise has a line in the power of the summed columns.
const RECORDINGS_PER_FALSE_LINE: f64 = 50.0;
/// Phases from column to column that are looked at, for each column.
const PHASES_PER_COLUMN: usize = 2;
/// Factor over the median of the surrounding power at which the rhythm of the presses has a line. The powers of presses without a rhythm are
/// distributed exponentially: `2^-10` of them exceed so much.
const RHYTHM_STANDS_OUT: f64 = 10.0;
/// Number of frequencies on each side that count as surrounding.
const AROUND: usize = 40;
const FAR_AROUND: usize = 200;
/// Least number of periods in the data; anything slower is a drift.
const PERIODS_LEAST: f64 = 12.0;
const LINES_MAX: usize = 3;
/// Fewer frames have no spectrum.
const FRAMES_LEAST: usize = 256;
/// Parts of a recording through whose medians a drift goes.
const DRIFT_PARTS: usize = 8;

/// A line in the spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    pub(crate) frequency_hz: f64,
    /// Phase from one column of the array to the next; 0 where only the powers of elements tell the line.
    pub(crate) phase_per_column_deg: f64,
}

/// A line's place among the frequencies, and how clear it is: over 1 by so much as its threshold is exceeded.
#[derive(Debug, Clone, Copy)]
struct Peak {
    at: usize,
    clearness: f64,
    line: Line,
}

/// True if there are enough frames without contact for a spectrum.
pub(super) fn is_seen(frames: &Frames) -> bool {
    Chosen::of(frames, |frame| frames.position_mm[frame][2] > 0.0).is_some()
}

/// Lines in the residual of the frames without contact, clearest first.
///
/// `residual`: frame by frame, element by element, of an array with so many columns.
pub(crate) fn lines(frames: &Frames, columns: usize, residual: &[f64]) -> Vec<Line> {
    let Some(idle) = Chosen::of(frames, |frame| frames.position_mm[frame][2] > 0.0) else {
        return Vec::new();
    };
    let mut power = vec![0.0; idle.size / 2];
    let mut sums = vec![vec![0.0; idle.frames.len()]; columns];
    for element in 0..frames.elements {
        let mut values = idle.of_element(element, frames.elements, residual);
        idle.take_off_drift(&mut values);
        for (value, sum) in values.iter().zip(&mut sums[element % columns]) {
            *sum += value;
        }
        for (power, of_element) in power.iter_mut().zip(idle.spectrum(&values)) {
            *power += squared(of_element);
        }
    }
    let of_powers = |at: usize| clearness(power[at], &power[around(at, AROUND, power.len())]) / STANDS_OUT;
    let rhythm = idle.rhythm();
    let mut peaks = idle.peaks(&power, &rhythm, 0.0, of_powers);
    peaks.extend(idle.of_columns(sums, &rhythm));
    clearest(peaks)
}

/// Lines in the residual of the frames in which the tip rests in contact, clearest first, as the sums of columns tell them: there all elements
/// have much together, so that the scatter of their powers tells nothing.
pub(crate) fn lines_in_contact(frames: &Frames, columns: usize, residual: &[f64]) -> Vec<Line> {
    let still = still(frames);
    let rests = |frame: usize| frames.position_mm[frame][2] <= 0.0 && still[frame] > 0;
    let Some(resting) = Chosen::of(frames, rests) else { return Vec::new() };
    let mut sums = vec![vec![0.0; resting.frames.len()]; columns];
    for element in 0..frames.elements {
        let values = resting.of_element(element, frames.elements, residual);
        sums[element % columns].iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
    clearest(resting.of_columns(sums, &resting.rhythm()))
}

/// The clearest of some peaks that are not neighbours.
fn clearest(mut peaks: Vec<Peak>) -> Vec<Line> {
    peaks.sort_by(|a, b| b.clearness.total_cmp(&a.clearness));
    let mut clearest: Vec<Peak> = Vec::new();
    for peak in peaks {
        if clearest.iter().all(|known| known.at.abs_diff(peak.at) > 1) && clearest.len() < LINES_MAX {
            clearest.push(peak);
        }
    }
    clearest.into_iter().map(|peak| peak.line).collect()
}

/// Some frames of the longest run, in slots of a frame's time.
struct Chosen {
    frames: Vec<usize>,
    /// The slot of each.
    slots: Vec<usize>,
    /// Number of slots, a power of two.
    size: usize,
    step_hz: f64,
    /// The first frequency with enough periods.
    first: usize,
}

impl Chosen {
    /// `None` where there are too few for a spectrum.
    fn of(frames: &Frames, is_chosen: impl Fn(usize) -> bool) -> Option<Self> {
        let interval_s = interval_s(frames);
        let mut begin = 0;
        let mut longest = (0, 0);
        for (_, end) in &frames.runs {
            if end - begin > longest.1 - longest.0 {
                longest = (begin, *end);
            }
            begin = *end;
        }
        let (begin, end) = longest;
        if begin == end {
            return None;
        }
        let duration_s = frames.t_s[end - 1] - frames.t_s[begin];
        let slot = |frame: usize| -> usize {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "not negative, and no more than frames"
            )]
            let slot = ((frames.t_s[frame] - frames.t_s[begin]) / interval_s).round() as usize;
            slot
        };
        let size = (slot(end - 1) + 1).next_power_of_two().min(1 << 18);
        let chosen: Vec<usize> =
            (begin..end).filter(|frame| slot(*frame) < size && is_chosen(*frame)).collect();
        // Times that stand still or run back have few slots.
        if chosen.len().min(size) < FRAMES_LEAST {
            return None;
        }
        let step_hz = 1.0 / (size as f64 * interval_s);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small positive number"
        )]
        let first = ((PERIODS_LEAST / duration_s / step_hz) as usize).max(2);
        Some(Self {
            slots: chosen.iter().map(|frame| slot(*frame)).collect(),
            frames: chosen,
            size,
            step_hz,
            first,
        })
    }

    /// What an element has in these frames.
    fn of_element(&self, element: usize, elements: usize, residual: &[f64]) -> Vec<f64> {
        self.frames.iter().map(|frame| residual[frame * elements + element]).collect()
    }

    /// The power of the times at which there are frames.
    fn rhythm(&self) -> Vec<f64> {
        self.spectrum(&vec![1.0; self.frames.len()]).into_iter().map(squared).collect()
    }

    /// Peaks of the sums of columns, each a phase further than the one before, but at the rhythm.
    fn of_columns(&self, mut sums: Vec<Vec<f64>>, rhythm: &[f64]) -> Vec<Peak> {
        // What all elements have from stretch to stretch leaks far.
        for sum in &mut sums {
            self.take_off_means(sum);
        }
        let of_columns: Vec<Vec<[f64; 2]>> = sums.iter().map(|sum| self.spectrum(sum)).collect();
        let phases = PHASES_PER_COLUMN * sums.len();
        let nats = (self.size as f64 / 2.0 * phases as f64 * RECORDINGS_PER_FALSE_LINE).ln();
        let of_phase = |phase: usize| {
            let phase = TAU * (phase as f64 / phases as f64 - 0.5);
            let together = summed(&of_columns, phase);
            // The power of noise is distributed exponentially, with a median of ln 2 of the mean.
            // Near a slope the nearest tell it best; elsewhere a median of few scatters too much.
            let of_sum = |at: usize| {
                let middle = |reach| median(&together[around(at, reach, together.len())]);
                LN_2 * together[at] / middle(AROUND).max(middle(FAR_AROUND)).max(f64::MIN_POSITIVE) / nats
            };
            self.peaks(&together, rhythm, phase.to_degrees(), of_sum)
        };
        (0..phases).flat_map(of_phase).collect()
    }

    /// Takes a slow drift off: straight lines between the medians of some parts, of which each has a period of the slowest tone at least. The
    /// presses would let it leak to other frequencies.
    fn take_off_drift(&self, values: &mut [f64]) {
        let count = values.len();
        let parts = (0..DRIFT_PARTS).map(|part| part * count / DRIFT_PARTS..(part + 1) * count / DRIFT_PARTS);
        let (at, middles): (Vec<f64>, Vec<f64>) = parts
            .filter(|part| !part.is_empty())
            .map(|part| (self.slots[usize::midpoint(part.start, part.end)] as f64, median(&values[part])))
            .unzip();
        let drift = Table { by: By::Time, at, values: middles };
        for (value, slot) in values.iter_mut().zip(&self.slots) {
            *value -= drift.value(*slot as f64);
        }
    }

    /// Takes the mean of each stretch of frames off its values.
    fn take_off_means(&self, values: &mut [f64]) {
        let mut begin = 0;
        for end in 1..=values.len() {
            if end == values.len() || self.slots[end] > self.slots[end - 1] + 1 {
                let stretch = &mut values[begin..end];
                let mean = stretch.iter().sum::<f64>() / stretch.len() as f64;
                for value in stretch {
                    *value -= mean;
                }
                begin = end;
            }
        }
    }

    /// The spectrum of a value of each frame, 0 where there is none.
    fn spectrum(&self, values: &[f64]) -> Vec<[f64; 2]> {
        let mut series = vec![[0.0; 2]; self.size];
        for (slot, value) in self.slots.iter().zip(values) {
            series[*slot][0] = *value;
        }
        transform(&mut series);
        series.truncate(self.size / 2);
        series
    }

    /// Where a power stands out of the surrounding ones, and the rhythm of the presses does not; `clearness` is above 1 where it does.
    fn peaks(
        &self,
        power: &[f64],
        rhythm: &[f64],
        phase_per_column_deg: f64,
        clearness: impl Fn(usize) -> f64,
    ) -> Vec<Peak> {
        let mut found = Vec::new();
        for at in self.first..power.len().saturating_sub(1) {
            if power[at] < power[at - 1] || power[at] < power[at + 1] {
                continue;
            }
            let clearness = clearness(at);
            let is_rhythm = || {
                let middle = median(&rhythm[around(at, AROUND, rhythm.len())]);
                rhythm[at - 1..=at + 1].iter().any(|one| *one > RHYTHM_STANDS_OUT * middle)
            };
            if clearness > 1.0 && !is_rhythm() {
                // The top of a parabola through the logarithms of three powers.
                let [left, top, right] =
                    [power[at - 1], power[at], power[at + 1]].map(|p| p.max(f64::MIN_POSITIVE).ln());
                let bend = left - 2.0 * top + right;
                let shift = if bend < 0.0 { 0.5 * (left - right) / bend } else { 0.0 };
                let line = Line { frequency_hz: (at as f64 + shift) * self.step_hz, phase_per_column_deg };
                found.push(Peak { at, clearness, line });
            }
        }
        found
    }
}

/// The frequencies near one, but for that of 0.
fn around(at: usize, reach: usize, frequencies: usize) -> Range<usize> {
    at.saturating_sub(reach).max(1)..(at + reach).min(frequencies)
}

/// Power of the columns' sum, each a phase further than the one before.
fn summed(of_columns: &[Vec<[f64; 2]>], phase: f64) -> Vec<f64> {
    let frequencies = of_columns.first().map_or(0, Vec::len);
    let mut sum = vec![[0.0; 2]; frequencies];
    for (column, spectrum) in of_columns.iter().enumerate() {
        let (sin, cos) = (-phase * column as f64).sin_cos();
        for (sum, [re, im]) in sum.iter_mut().zip(spectrum) {
            sum[0] += re * cos - im * sin;
            sum[1] += re * sin + im * cos;
        }
    }
    sum.into_iter().map(squared).collect()
}

fn squared([re, im]: [f64; 2]) -> f64 {
    re * re + im * im
}

/// Height of a power above the surrounding ones, in units of their scatter.
fn clearness(power: f64, around: &[f64]) -> f64 {
    let middle = median(around);
    let off: Vec<f64> = around.iter().map(|one| (one - middle).abs()).collect();
    (power - middle) / (NORMAL_PER_MEDIAN * median(&off)).max(f64::MIN_POSITIVE)
}

/// The discrete Fourier transform in place; the number of points is a power of two.
///
/// # Source
/// J. W. Cooley and J. W. Tukey, *Math. Comput.* 19 (1965) 297.
pub(crate) fn transform(series: &mut [[f64; 2]]) {
    let count = series.len();
    let bits = count.trailing_zeros();
    for index in 0..count {
        let mirrored = index.reverse_bits() >> (usize::BITS - bits);
        if mirrored > index {
            series.swap(index, mirrored);
        }
    }
    let mut half = 1;
    while half < count {
        let turn = -std::f64::consts::PI / half as f64;
        let factors: Vec<[f64; 2]> =
            (0..half).map(|k| [(turn * k as f64).cos(), (turn * k as f64).sin()]).collect();
        for block in series.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for ((low, high), [cos, sin]) in low.iter_mut().zip(high).zip(&factors) {
                let turned = [high[0] * cos - high[1] * sin, high[0] * sin + high[1] * cos];
                *high = [low[0] - turned[0], low[1] - turned[1]];
                *low = [low[0] + turned[0], low[1] + turned[1]];
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
#[path = "spectrum_tests.rs"]
mod tests;
