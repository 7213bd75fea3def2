//! Elimination of gains and baselines: the part of a residual or a derivative that they cannot fit.

use super::gains::GAIN_ERROR_MAX;
use super::parameters::Parameters;
use super::problem::Problem;
use super::random_walk::Baselines;
use crate::data::DiscoverError;

/// Projection that removes gains and baselines, at one point of the parameters.
pub(crate) struct Linear<'a> {
    problem: &'a Problem<'a>,
    baselines: Baselines<'a>,
    /// Derivative of the counts by each element's relative gain, less the part that the baselines fit.
    by_gain: Vec<f64>,
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
        baselines.centre(&mut by_gain);
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
        Ok(Linear { problem: self, baselines, by_gain, by_gain_squares })
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
}
