//! Elimination of gains and baselines: the part of a residual or a derivative that they cannot fit.

use super::parameters::Parameters;
use super::problem::Problem;
use super::random_walk::Baselines;
use crate::data::DiscoverError;
use crate::numbers::median;

/// Range of an element's recalibrated gain relative to the declared one, as a share of the array's typical value. An element
/// outside has another fault than a different gain.
const GAIN_RATIOS: [f64; 2] = [0.25, 4.0];
/// A gain within this share of an end of the range counts as at the end.
const PIN_MARGIN: f64 = 0.02;
/// An element keeps its declared gain if the relative error of its fitted gain would be greater than this.
pub(crate) const GAIN_ERROR_MAX: f64 = 0.3;

/// Projection that removes gains and baselines, at one point of the parameters.
pub(crate) struct Linear<'a> {
    problem: &'a Problem<'a>,
    baselines: Baselines<'a>,
    /// Derivative of the counts by each element's relative gain, less the part that the baselines fit.
    by_gain: Vec<f64>,
    /// The part of it that the baselines fit: run by run, knot by knot.
    by_gain_taken: Vec<Vec<f64>>,
    /// Weighted sum of squares of `by_gain` for every element; 0 where the gain is not fitted.
    by_gain_squares: Vec<f64>,
}

impl<'a> Problem<'a> {
    /// The projection at a point.
    pub(crate) fn linear(&'a self, at: &Parameters, predicted: &[f64]) -> Result<Linear<'a>, DiscoverError> {
        let mut more = at.clone();
        let share = 1e-3;
        for sensitivity in &mut more.sensitivity {
            *sensitivity *= 1.0 + share;
        }
        let mut by_gain = self.predict(&more)?;
        for (slope, predicted) in by_gain.iter_mut().zip(predicted) {
            *slope = (*slope - predicted) / share;
        }
        let elements = self.predictor.bins.elements;
        let baselines = Baselines::of(self, at);
        let by_gain_taken = baselines.centre(&mut by_gain);
        let mut by_gain_squares = vec![0.0; elements];
        for ((slope, weight), element) in by_gain.iter().zip(self.weights()).zip((0..elements).cycle()) {
            by_gain_squares[element] += weight * slope * slope;
        }
        let pinned = self.pinned(at);
        for (squares, pinned) in by_gain_squares.iter_mut().zip(&pinned) {
            if pinned.is_some() || *squares * GAIN_ERROR_MAX * GAIN_ERROR_MAX < 1.0 {
                *squares = 0.0;
            }
        }
        Ok(Linear { problem: self, baselines, by_gain, by_gain_taken, by_gain_squares })
    }

    /// The shares of the elements whose gain is at an end of its range. Each stays there, whatever becomes of the typical gain,
    /// and an effect may explain the rest.
    pub(crate) fn pinned(&self, at: &Parameters) -> Vec<Option<f64>> {
        let declared = &self.predictor.known.response.sensitivity_counts_per_mm;
        let ratios: Vec<f64> =
            at.sensitivity.iter().zip(declared).map(|(now, declared)| now / declared).collect();
        let of_weighed = ratios.iter().zip(&self.element_weight).filter(|(_, weight)| **weight > 0.0);
        let typical = median(&of_weighed.map(|(ratio, _)| *ratio).collect::<Vec<_>>());
        let [least, most] = GAIN_RATIOS;
        let is_at_an_end =
            |share: &f64| *share <= least * (1.0 + PIN_MARGIN) || *share >= most * (1.0 - PIN_MARGIN);
        ratios.iter().map(|ratio| Some(ratio / typical).filter(is_at_an_end)).collect()
    }
}

impl Linear<'_> {
    /// Removes from a column the part that gains and baselines can fit; bin by bin, element by element.
    pub(crate) fn project(&self, column: &mut [f64]) {
        self.baselines.centre(column);
        let elements = self.by_gain_squares.len();
        let shares = self.shares(column);
        for (values, slopes) in column.chunks_exact_mut(elements).zip(self.by_gain.chunks_exact(elements)) {
            for ((value, slope), share) in values.iter_mut().zip(slopes).zip(&shares) {
                *value -= share * slope;
            }
        }
    }

    /// The relative change of each gain that fits a column best.
    fn shares(&self, column: &[f64]) -> Vec<f64> {
        let elements = self.by_gain_squares.len();
        let mut sums = vec![0.0; elements];
        let bins = column.chunks_exact(elements).zip(self.by_gain.chunks_exact(elements));
        for ((values, slopes), weight) in bins.zip(&self.problem.train) {
            if *weight > 0.0 {
                for ((sum, value), slope) in sums.iter_mut().zip(values).zip(slopes) {
                    *sum += weight * value * slope;
                }
            }
        }
        for ((sum, squares), weight) in
            sums.iter_mut().zip(&self.by_gain_squares).zip(&self.problem.element_weight)
        {
            *sum = if *squares > 0.0 { *sum * weight / squares } else { 0.0 };
        }
        sums
    }

    /// Moves gains and baselines to fit `left`, a residual without random walks.
    pub(crate) fn take_up(&self, left: &[f64], parameters: &mut Parameters) {
        let elements = self.by_gain_squares.len();
        let mut centred = left.to_vec();
        let mut baselines = self.baselines.centre(&mut centred);
        let shares = self.shares(&centred);
        let declared = &self.problem.predictor.known.response.sensitivity_counts_per_mm;
        let ratios: Vec<f64> = parameters
            .sensitivity
            .iter()
            .zip(declared)
            .zip(&shares)
            .zip(&self.by_gain_squares)
            .filter(|(((_, declared), _), squares)| **squares > 0.0 && **declared != 0.0)
            .map(|(((now, declared), share), _)| now * (1.0 + share) / declared)
            .collect();
        let typical = if ratios.is_empty() { 1.0 } else { median(&ratios) };
        let pinned = self.problem.pinned(parameters);
        let mut taken = vec![0.0; elements];
        for element in 0..elements {
            let now = parameters.sensitivity[element];
            let bounds = GAIN_RATIOS.map(|ratio| ratio * typical * declared[element]);
            let (least, most) = (bounds[0].min(bounds[1]), bounds[0].max(bounds[1]));
            let wanted = if let Some(share) = pinned[element] {
                share * typical * declared[element]
            } else if self.by_gain_squares[element] > 0.0 {
                now * (1.0 + shares[element])
            } else {
                typical * declared[element]
            };
            let next = if least < most { wanted.clamp(least, most) } else { wanted };
            taken[element] = if now == 0.0 { 0.0 } else { next / now - 1.0 };
            parameters.sensitivity[element] = next;
        }
        // The baselines' fit, corrected for the change of the gains.
        for (baselines, by_gain) in baselines.iter_mut().zip(&self.by_gain_taken) {
            for ((zero, by_gain), taken) in baselines.iter_mut().zip(by_gain).zip(taken.iter().cycle()) {
                *zero -= taken * by_gain;
            }
        }
        self.baselines.put(baselines, parameters);
    }
}
