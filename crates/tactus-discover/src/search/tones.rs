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

/// Cells of the covariate's range; the transform has several times as many points, so that no tone lies between two frequencies.
const CELLS: usize = 8192;
const FINER: usize = 4;
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
    let (range, [wanted, square]) = (cells.range, cells.total());
    let mean = wanted / square;
    let mut series = vec![[0.0; 2]; FINER * CELLS];
    for (at, [wanted, square]) in series.iter_mut().zip(&cells.sums) {
        at[0] = wanted - mean * square;
    }
    transform(&mut series);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "positive; what is too large is cut off"
    )]
    let most = (per_unit_most * range) as usize;
    let frequencies = PERIODS_LEAST..most.min(CELLS / CELLS_LEAST);
    let power = |place: &usize| series[*place][0].powi(2) + series[*place][1].powi(2);
    let places = FINER * frequencies.start..FINER * frequencies.end;
    let best = places.max_by(|a, b| power(a).total_cmp(&power(b)))?;
    let centred = |[wanted, square]: &[f64; 2]| wanted - mean * square;
    let series: Vec<f64> = cells.sums.iter().map(centred).collect();
    let periods = between(&series, best as f64 / FINER as f64);
    Some(Tone { per_unit: periods / range, among: frequencies.len() as f64 })
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
