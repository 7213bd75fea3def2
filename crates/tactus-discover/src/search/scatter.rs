//! Whether the noise grows with what the sensor does: with a signal, its slope, its change, or contact.
//!
//! A gain that flickers or a table that shakes leaves no mean in the residual. What it leaves is a scatter that is larger where the signal, or
//! its slope, is larger. No effect of the library acts so, and a test of means cannot see it. With `q` the cube root of a bin's mean squared
//! departure, `n` how many departures that are, `v` what the scatter may grow with, and `q` and `v` taken from their means over the element's
//! bins with the same `n`,
//!
//! ```text
//! T = sum over bins and elements of n (v - mean v) (q - mean q)
//! ```
//!
//! is 0 in the mean if the scatter is always the same. Blocks are independent, and the cube root of a mean square is nearly normal, so the signs
//! of the blocks' parts are flipped. At rest departures are those of a bin's frames from the straight line through them, which needs no model; in
//! motion a bin has one, its residual times the root of the number of its frames, and `q` and `v` are taken from the means over bins of as many.
//!
//! Where the noise is smaller than the converter's step, its scatter depends on where between two codes a reading lies. Then nothing is tested.
//!
//! # Source
//! A regression of squares on what the variance may depend on: T. S. Breusch and A. R. Pagan, *Econometrica* 47 (1979) 1287. The cube root:
//! E. B. Wilson and M. M. Hilferty, *Proc. Natl. Acad. Sci.* 17 (1931) 684.

use super::covariates::Forms;
use super::grow::Search;
use super::score::sign_flip_p;
use crate::data::DiscoverError;
use crate::fit::Fitted;
use crate::numbers::{StraightLine, median, parallel};

/// Least number of frames of a bin at rest; a line through them takes two.
const REST_FRAMES: usize = 3;
/// Least noise, in steps of the converter.
const NOISE_STEPS: f64 = 0.7;
/// Flipped data sets: enough for a small p-value that is corrected for many tests.
const FLIPS: usize = 9999;
/// Changes the seed, so that scatter has other sign flips than means.
const STREAM: u64 = 0x5ca7_7e12;

/// What the scatter may grow with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum With {
    Signal,
    Slope,
    Contact,
    Change,
}

/// What a test of the noise rejects most clearly: here, the strongest growth of the scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scattered {
    /// Corrected for all that was tested.
    pub(crate) p_value: f64,
    /// In words; empty if nothing was tested.
    pub(crate) with: &'static str,
}

impl With {
    const ALL: [Self; 4] = [Self::Signal, Self::Slope, Self::Contact, Self::Change];

    const fn name(self) -> &'static str {
        match self {
            Self::Signal => "noise that grows with the signal",
            Self::Slope => "noise that grows with the slope of the image",
            Self::Contact => "noise that grows in contact",
            Self::Change => "noise that grows with the change of the signal",
        }
    }

    /// True if it acts where the tip rests.
    fn at_rest(self) -> bool {
        self != Self::Change
    }
}

/// A bin's departures of one element.
#[derive(Debug, Clone, Copy)]
struct Departures {
    bin: usize,
    /// Of how many frames the bin is.
    frames: usize,
    /// How many independent ones there are.
    count: usize,
    /// Cube root of their mean square.
    size: f64,
    /// What the scatter may grow with.
    value: f64,
}

impl Search<'_> {
    /// Tests whether the scatter of the readings is the same everywhere.
    pub(crate) fn scattered(&self, at: &Fitted) -> Result<Scattered, DiscoverError> {
        self.memory.scattered.at(&at.parameters, || self.scattered_at(at))
    }

    fn scattered_at(&self, at: &Fitted) -> Result<Scattered, DiscoverError> {
        let mut most = Scattered { p_value: 1.0, with: "" };
        let weights = self.problem.element_weight.iter().filter(|weight| **weight > 0.0);
        let noise_counts = median(&weights.map(|weight| weight.sqrt().recip()).collect::<Vec<_>>());
        let predictor = &self.problem.predictor;
        let step_counts = predictor.frames.step_of_means(predictor.known.array.step_counts());
        if self.rounds || noise_counts < NOISE_STEPS * step_counts {
            return Ok(most);
        }
        let forms = Forms::of(self.problem, &at.parameters, &at.predicted)?;
        let p_value = |(number, with): (usize, With)| {
            let blocks = self.by_blocks(at, &forms, with);
            sign_flip_p(&blocks, FLIPS, self.options.seed ^ STREAM ^ number as u64)
        };
        let numbered: Vec<(usize, With)> = With::ALL.into_iter().enumerate().collect();
        let p_values = parallel::map(&numbered, |one| p_value(*one));
        for (with, p_value) in With::ALL.into_iter().zip(p_values) {
            let corrected = (p_value * With::ALL.len() as f64).min(1.0);
            if corrected < most.p_value {
                most = Scattered { p_value: corrected, with: with.name() };
            }
        }
        Ok(most)
    }

    /// Each block's part of the sum.
    fn by_blocks(&self, at: &Fitted, forms: &Forms, with: With) -> Vec<f64> {
        let bins = self.problem.predictor.bins;
        let mut blocks = vec![0.0; bins.blocks];
        // Means of fewer frames scatter more.
        let are_usual = self.problem.predictor.frames.are_usual();
        let is_usual =
            |bin: usize| are_usual[bins.first[bin]..bins.first[bin + 1]].iter().all(|usual| *usual);
        for element in (0..bins.elements).filter(|element| self.problem.element_weight[*element] > 0.0) {
            let mut departures = self.departures(at, forms, with, &is_usual, element);
            departures.sort_by_key(|of| of.frames);
            for alike in departures.chunk_by(|one, next| one.frames == next.frames) {
                let mean =
                    |of: fn(&Departures) -> f64| alike.iter().map(of).sum::<f64>() / alike.len() as f64;
                let (size, value) = (mean(|of| of.size), mean(|of| of.value));
                for of in alike.iter().filter(|_| size > 0.0) {
                    blocks[bins.block[of.bin]] +=
                        of.count as f64 * (of.value - value) * (of.size / size - 1.0);
                }
            }
        }
        blocks
    }

    fn departures(
        &self,
        at: &Fitted,
        forms: &Forms,
        with: With,
        is_usual: &impl Fn(usize) -> bool,
        element: usize,
    ) -> Vec<Departures> {
        let problem = self.problem;
        let (bins, frames) = (problem.predictor.bins, problem.predictor.frames);
        let (elements, last) = (bins.elements, bins.len().saturating_sub(1));
        let mut departures = Vec::new();
        for bin in (0..bins.len()).filter(|bin| problem.train[*bin] > 0.0 && is_usual(*bin)) {
            let reading = bin * elements + element;
            let (in_bin, rests) = (bins.frames_in(bin), !bins.moves[bin]);
            let (square, count) = if with.at_rest() && rests && in_bin >= REST_FRAMES {
                let counts = (bins.first[bin]..bins.first[bin + 1])
                    .map(|frame| f64::from(frames.counts[frame * elements + element]));
                (from_line(counts), in_bin - 2)
            } else if !with.at_rest() && (in_bin == 1 || !rests) {
                (in_bin as f64 * (bins.counts[reading] - at.predicted[reading]).powi(2), 1)
            } else {
                continue;
            };
            let value = match with {
                With::Signal => forms.signal()[reading].powi(2),
                With::Slope => forms.slope(0)[reading].powi(2) + forms.slope(1)[reading].powi(2),
                With::Contact => f64::from(u8::from(forms.history().depth_mm[bin] > 0.0)),
                With::Change => {
                    let [before, after] = [bin.saturating_sub(1), (bin + 1).min(last)];
                    if bins.run[before] != bins.run[after] {
                        continue;
                    }
                    let of = |bin: usize| at.predicted[bin * elements + element];
                    ((of(after) - of(before)) / (bins.t_s[after] - bins.t_s[before]).max(f64::MIN_POSITIVE))
                        .powi(2)
                }
            };
            departures.push(Departures {
                bin,
                frames: in_bin,
                count,
                size: (square / count as f64).cbrt(),
                value,
            });
        }
        departures
    }
}

/// The sum of squared departures of values from a straight line through them.
fn from_line(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let line = StraightLine::through(values.clone());
    values.enumerate().map(|(place, value)| (value - line.at(place)).powi(2)).sum()
}

#[cfg(test)]
#[path = "scatter_tests.rs"]
mod tests;
