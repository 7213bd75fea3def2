//! Whether each reading's noise is its own.
//!
//! A model's noise differs from element to element, and no reading is far out. An excitation that flickers, an amplifier that serves a row or
//! the mains in the array move several elements together, in the mean by nothing, so that no test of means sees them. While the tip rests, with
//! `d` the departures of an element's residuals from a parabola within a window of time, in standard deviations, and `p` a pattern,
//!
//! ```text
//! C(e, e') = p(e, e') sum over the window's frames of d(e) d(e')
//! T = sum of C over pairs of elements and windows        z = T / sqrt(sum of C^2)
//! ```
//!
//! If the elements' noises are independent and symmetric, each element's departures in a window could as well have the other sign. Then
//! `T` has a mean of 0 and the variance under the root, however large each noise is and however long it remembers. The patterns are all pairs,
//! those of a row, those of a column, and the product of the two signals.
//!
//! A single reading is far out by how much its residual differs from the mean of the one before and the one after, wherever the tip
//! neither starts nor stops; all of them count as alternatives (Bonferroni).
//!
//! # Source
//! Signs that could as well be others: R. A. Fisher, *The Design of Experiments* (1935), section 21.

use std::ops::Range;

use nalgebra::DMatrix;

use super::residual::Residual;
use crate::data::turns;
use crate::fit::Prepared;
use crate::numbers::upper_tail;
use crate::search::Scattered;

/// Frames of a window, half a second of the paper's sensor: as long as the longest bin.
const WINDOW_FRAMES: usize = 15;
/// Variance of the difference between a reading and the mean of its neighbours, over that of a reading.
const DIFFERENCE_VARIANCE: f64 = 1.5;
/// Variance of rounding, in squared steps.
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;

/// A model's residual where the tip rests.
struct AtRest<'a> {
    elements: usize,
    /// Elements of a row.
    cols: usize,
    /// In counts: frame by frame, element by element.
    residual: &'a [f32],
    /// As the model predicts it, in counts: frame by frame, element by element.
    signal: &'a [f32],
    /// Frames of each window.
    windows: &'a [Range<usize>],
    /// Frames that are compared with the one before and the one after.
    singles: &'a [usize],
    /// Standard deviation of each element's noise; infinite for those without weight.
    noise_counts: &'a [f64],
    /// Step of the converter.
    step_counts: f64,
}

/// What elements that move together have in common.
#[derive(Debug, Clone, Copy)]
enum Pattern {
    All,
    Row,
    Column,
    Signal,
}

/// The sum over pairs and windows, and its variance.
#[derive(Debug, Clone, Copy, Default)]
struct Shared {
    sum: f64,
    variance: f64,
}

impl Pattern {
    const ALL: [Self; 4] = [Self::All, Self::Row, Self::Column, Self::Signal];

    const fn name(self) -> &'static str {
        match self {
            Self::All => "noise that all elements share",
            Self::Row => "noise that the elements of a row share",
            Self::Column => "noise that the elements of a column share",
            Self::Signal => "noise that elements share by their signals",
        }
    }
}

impl Prepared<'_> {
    /// Whether the noise of the fitted frames is each reading's own.
    pub(super) fn own_noise(&self, of: &Residual) -> Scattered {
        let (frames, elements) = (self.frames, self.frames.elements);
        let is_fitted = |frame: usize| !self.heldout.frames[frame];
        // Means of fewer frames scatter more.
        let are_usual = frames.are_usual();
        // A window begins as long after the tip came to rest as it lasts.
        let is_window = |window: &Range<usize>| {
            self.still[window.end - 1] >= 2 * WINDOW_FRAMES - 1
                && window.clone().all(|frame| is_fitted(frame) && are_usual[frame])
        };
        let mut windows: Vec<Range<usize>> = Vec::new();
        for end in WINDOW_FRAMES..=frames.len() {
            let window = end - WINDOW_FRAMES..end;
            if windows.last().is_none_or(|last| last.end <= window.start) && is_window(&window) {
                windows.push(window);
            }
        }
        let turns = turns(frames);
        // What a converter that is not as declared does to a moving signal is no normal noise.
        let is_smooth = |frame: usize| {
            is_fitted(frame)
                && !turns[frame]
                && are_usual[frame]
                && (self.converter.is_none() || self.still[frame] >= WINDOW_FRAMES)
        };
        let is_one_run = |frame: usize| self.whole.run[frame - 1] == self.whole.run[frame + 1];
        let singles: Vec<usize> = (1..frames.len().saturating_sub(1))
            .filter(|frame| is_one_run(*frame) && (frame - 1..=frame + 1).all(is_smooth))
            .collect();
        let at_rest = AtRest {
            elements,
            cols: self.known.array.cols(),
            residual: &of.counts,
            signal: &of.signal,
            windows: &windows,
            singles: &singles,
            noise_counts: &self.noise.by_element_counts,
            step_counts: self.step_counts,
        };
        at_rest.shared_or_far_out()
    }
}

impl AtRest<'_> {
    /// The clearest sign that noise is shared or readings are far out, corrected for the number of tests.
    fn shared_or_far_out(&self) -> Scattered {
        let shared = self.shared();
        let mut found: Vec<(f64, &'static str)> = Pattern::ALL
            .into_iter()
            .zip(shared)
            .filter(|(_, shared)| shared.variance > 0.0)
            .map(|(pattern, Shared { sum, variance })| (upper_tail(sum / variance.sqrt()), pattern.name()))
            .collect();
        found.push((self.far_out(), "single readings"));
        let tests = Pattern::ALL.len() as f64 + 1.0;
        let least = found.into_iter().min_by(|one, other| one.0.total_cmp(&other.0));
        let (p_value, with) = least.unwrap_or((1.0, ""));
        Scattered { p_value: (tests * p_value).min(1.0), with }
    }

    fn shared(&self) -> [Shared; Pattern::ALL.len()] {
        let mut shared = [Shared::default(); Pattern::ALL.len()];
        let parabolas = parabolas();
        let weighed = self.weighed();
        for window in self.windows {
            let departures = self.departures(window, &weighed, &parabolas);
            let products = departures.transpose() * &departures;
            let middle = window.start + window.len() / 2;
            let signal = |element: usize| f64::from(self.signal[middle * self.elements + element]);
            for (i, one) in weighed.iter().enumerate() {
                for (j, other) in weighed.iter().enumerate().skip(i + 1) {
                    for (pattern, shared) in Pattern::ALL.into_iter().zip(&mut shared) {
                        let weight = match pattern {
                            Pattern::All => 1.0,
                            Pattern::Row => f64::from(u8::from(one / self.cols == other / self.cols)),
                            Pattern::Column => f64::from(u8::from(one % self.cols == other % self.cols)),
                            Pattern::Signal => signal(*one) * signal(*other),
                        };
                        let part = weight * products[(i, j)];
                        shared.sum += part;
                        shared.variance += part * part;
                    }
                }
            }
        }
        shared
    }

    /// Elements with a weight.
    fn weighed(&self) -> Vec<usize> {
        (0..self.elements).filter(|element| self.noise_counts[*element].is_finite()).collect()
    }

    fn residual(&self, frame: usize, element: usize) -> f64 {
        f64::from(self.residual[frame * self.elements + element])
    }

    /// Departures from a parabola, in standard deviations: frame by frame, for each element with a weight.
    fn departures(&self, window: &Range<usize>, weighed: &[usize], parabolas: &DMatrix<f64>) -> DMatrix<f64> {
        let mut departures = DMatrix::from_fn(window.len(), weighed.len(), |frame, one| {
            let element = weighed[one];
            self.residual(window.start + frame, element) / self.deviation(element)
        });
        let fitted = parabolas.transpose() * &departures;
        departures -= parabolas * fitted;
        departures
    }

    /// Of a reading, its rounding included.
    fn deviation(&self, element: usize) -> f64 {
        (self.noise_counts[element].powi(2) + ROUNDING_VARIANCE * self.step_counts.powi(2)).sqrt()
    }

    /// The probability of a reading that is as far out as the farthest.
    fn far_out(&self) -> f64 {
        let (mut farthest, mut count) = (0.0_f64, 0.0);
        for element in self.weighed() {
            let deviation = DIFFERENCE_VARIANCE.sqrt() * self.deviation(element);
            for frame in self.singles {
                let beside =
                    f64::midpoint(self.residual(frame - 1, element), self.residual(frame + 1, element));
                farthest = farthest.max((self.residual(*frame, element) - beside).abs() / deviation);
                count += 1.0;
            }
        }
        if count > 0.0 { (2.0 * count * upper_tail(farthest)).min(1.0) } else { 1.0 }
    }
}

/// Orthonormal functions of the frames of a window, of which all parabolas are sums.
fn parabolas() -> DMatrix<f64> {
    let powers = DMatrix::from_fn(WINDOW_FRAMES, 3, |frame, power| {
        let place = frame as f64 - 0.5 * (WINDOW_FRAMES as f64 - 1.0);
        (0..power).map(|_| place).product::<f64>()
    });
    powers.qr().q()
}

#[cfg(test)]
#[path = "own_noise_tests.rs"]
mod tests;
