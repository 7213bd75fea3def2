//! Tones in a covariate: the frequency that a residual shows most clearly, and among how many.
//!
//! The residual and the square of what the tone multiplies are summed in narrow cells of the covariate. With `q` and `s` those sums of a
//! cell at `v`, the power of a frequency `f` is
//!
//! ```text
//! P(f) = | sum over cells of (q - s sum q / sum s) exp(2 pi i f v) |^2
//! ```
//!
//! The greatest of many powers is large without a tone too, so who picks a frequency is charged for the number of those it was picked
//! from.
//!
//! # Source
//! J. D. Scargle, *Astrophys. J.* 263 (1982) 835: the periodogram, and the false alarms of its greatest power.

use super::cells::{Cells, Point};
use crate::data::spectrum::transform;
use crate::numbers::median;

/// Cells of the covariate's range; the transform has several times as many points, so that no tone lies between two frequencies.
const CELLS: usize = 8192;
const FINER: usize = 4;
/// Readings pause where the next one is so many times as far away as usual.
const PAUSE: f64 = 2.5;
/// Factor over the median of the powers around, within ten periods, and over the power of starts without a rhythm, at which presses have one.
const RHYTHM_STANDS_OUT: f64 = 10.0;
const AROUND: usize = 10 * FINER;
/// So often is the distance between two tried frequencies halved.
const HALVINGS: i32 = 8;
/// Least number of periods in the range; anything slower is a smooth function.
const PERIODS_LEAST: usize = 3;
/// A period has at least this many cells.
const CELLS_LEAST: usize = 4;
/// A tone in counts has a period of at least so many steps of the converter: anything shorter is its rounding, which is no tone of the sensor.
const STEPS_LEAST: f64 = 2.0;

/// A frequency that was picked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tone {
    /// Periods per unit of the covariate.
    pub(super) per_unit: f64,
    /// Number of independent frequencies from which it was picked.
    pub(super) among: f64,
}

/// Most periods per count of a tone in counts.
pub(super) fn most_per_count(step_counts: f64) -> f64 {
    (STEPS_LEAST * step_counts).recip()
}

/// The clearest tone of at most so many periods per unit; `None` if the covariate does not vary, or not by enough for one.
pub(super) fn clearest(points: &(impl Iterator<Item = Point> + Clone), per_unit_most: f64) -> Option<Tone> {
    let cells = Cells::of(points, CELLS)?;
    cells.clearest(per_unit_most, |_| true)
}

/// The clearest tone in time but at the rhythm at which presses come: there it is what every press repeats. The pauses between readings tell the rhythm,
/// so that there is none where readings go on, or where several runs lie over each other.
pub(super) fn clearest_beside_rhythm(points: &(impl Iterator<Item = Point> + Clone)) -> Option<Tone> {
    let cells = Cells::of(points, CELLS)?;
    let starts = cells.starts();
    // Starts without a rhythm have this power.
    let count = starts.iter().sum::<f64>();
    let rhythm = powers(starts.into_iter().map(|start| start - count / CELLS as f64));
    let is_beside = |place: usize| {
        let around = |reach: usize| place.saturating_sub(reach)..(place + reach + 1).min(rhythm.len());
        let middle = median(&rhythm[around(AROUND)]).max(count);
        rhythm[around(FINER)].iter().all(|power| *power <= RHYTHM_STANDS_OUT * middle)
    };
    cells.clearest(f64::INFINITY, is_beside)
}

impl Cells {
    /// 1 at the cells where readings come again after a pause, else 0.
    fn starts(&self) -> Vec<f64> {
        let read: Vec<usize> = (0..self.sums.len()).filter(|cell| self.sums[*cell][1] > 0.0).collect();
        let apart: Vec<f64> = read.windows(2).map(|two| (two[1] - two[0]) as f64).collect();
        let usual = if apart.is_empty() { 0.0 } else { median(&apart) };
        let mut starts = vec![0.0; self.sums.len()];
        for (two, apart) in read.windows(2).zip(&apart) {
            if *apart > PAUSE * usual {
                starts[two[1]] = 1.0;
            }
        }
        starts
    }

    fn clearest(&self, per_unit_most: f64, is_allowed: impl Fn(usize) -> bool) -> Option<Tone> {
        let (range, [wanted, square]) = (self.range, self.total());
        let mean = wanted / square;
        let series = || self.sums.iter().map(|[wanted, square]| wanted - mean * square);
        let power = powers(series());
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive; what is too large is cut off"
        )]
        let most = (per_unit_most * range) as usize;
        let frequencies = PERIODS_LEAST..most.min(CELLS / CELLS_LEAST);
        let mut places: Vec<usize> = (FINER * frequencies.start..FINER * frequencies.end).collect();
        places.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
        let is_top = |place: usize| power[place] >= power[place - 1].max(power[place + 1]);
        let best = places.into_iter().find(|place| is_top(*place) && is_allowed(*place))?;
        let periods = between(&series().collect::<Vec<f64>>(), best as f64 / FINER as f64);
        Some(Tone { per_unit: periods / range, among: frequencies.len() as f64 })
    }
}

/// The powers of a series of cells at frequencies that are closer by [`FINER`] than independent ones.
fn powers(series: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut padded: Vec<[f64; 2]> = series.map(|value| [value, 0.0]).collect();
    padded.resize(FINER * CELLS, [0.0; 2]);
    transform(&mut padded);
    padded.iter().map(|[re, im]| re * re + im * im).collect()
}

/// The number of periods in the range, between the tried ones, at which the power is greatest: a tone that is off by an eighth of a period at the ends
/// of the data would be off by more beyond them.
fn between(series: &[f64], periods: f64) -> f64 {
    let power = |periods: f64| {
        let turn = std::f64::consts::TAU * periods / series.len() as f64;
        let [mut real, mut imaginary] = [0.0; 2];
        for (cell, value) in series.iter().enumerate() {
            let (sin, cos) = (turn * cell as f64).sin_cos();
            real += value * cos;
            imaginary += value * sin;
        }
        real * real + imaginary * imaginary
    };
    let mut best = (power(periods), periods);
    for halving in 1..=HALVINGS {
        let step = 0.5_f64.powi(halving) / FINER as f64;
        for next in [best.1 - step, best.1 + step] {
            let of_next = power(next);
            if of_next > best.0 {
                best = (of_next, next);
            }
        }
    }
    best.1
}

#[cfg(test)]
#[path = "tones_tests.rs"]
mod tests;
