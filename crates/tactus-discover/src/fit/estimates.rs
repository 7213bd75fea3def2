//! How far the predictions of a fitted model are off because its numbers were estimated from noisy readings.
//!
//! A model of the true physics leaves more than noise on presses that were not fitted: its gains, baselines and parameters have errors. With
//! `J` the derivatives of the prediction by all fitted numbers,
//!
//! ```text
//! C = (sum over fitted readings of J J' / noise^2)^-1             covariance of the numbers
//! mean over held-out readings of J' C J / noise^2                 what their errors add to the squares there
//! ```
//!
//! A fold of the fitted presses is predicted by a fit to the others, of which the numbers have a covariance of their own.
//!
//! Gains and baselines act on one element each, so `C` has a part for each element, and one for the shared numbers less what gains and
//! baselines fit of them ([`super::elimination`]).

use nalgebra::DMatrix;

use super::elimination::Elimination;
use super::problem::{Fitted, Problem};
use super::tiles::Border;
use super::totals::{Kept, Segments, Total};
use crate::data::DiscoverError;

/// A direction of which the fitted readings show less than this share is none that was estimated.
const SHOWN_LEAST: f64 = 1e-6;

/// The sum of the squared errors of predictions of some readings that a fit to others has not seen, in units of the noise's variance.
pub(super) fn errors(elimination: &Elimination, fitted: &Total, predicted: &Total) -> f64 {
    own_errors(elimination, fitted, predicted) + shared_errors(elimination, predicted)
}

impl Problem<'_> {
    /// Mean square of the errors of a fitted model's predictions of held-out frames, in units of the noise's variance. `None` for models
    /// with random walks, which have a state of their own in every press.
    pub(crate) fn estimation_error(&self, at: &Fitted) -> Result<Option<f64>, DiscoverError> {
        if at.parameters.walk.is_some() {
            return Ok(None);
        }
        let segments = Segments::of(self, &at.parameters);
        let sums_of = |problem: &Self| -> Result<Total, DiscoverError> {
            let own = problem.own(&at.parameters);
            let count = own.len();
            problem.sums(&at.parameters, &at.predicted, own, count, Kept::All, &segments)
        };
        let held = self.of_held_out_frames();
        let (fitted, held_out) = (sums_of(self)?, sums_of(&held)?);
        let elimination = Elimination::of(self, &fitted, &segments, &at.parameters);
        let errors = errors(&elimination, &fitted, &held_out);
        Ok(Some(self.variance * errors / held.weighed_readings()))
    }

    /// The same problem with each held-out frame in place of the fitted ones.
    fn of_held_out_frames(&self) -> Self {
        let bins = self.predictor.bins;
        let weight = |bin: usize| {
            let is_judged = bins.heldout[bin] && bins.weight[bin] > 0.0;
            if is_judged { bins.frames_in(bin) as f64 } else { 0.0 }
        };
        Self { train: (0..bins.len()).map(weight).collect(), ..self.clone() }
    }

    /// Number of readings that together have the weight of the fitted ones; at least 1.
    pub(super) fn weighed_readings(&self) -> f64 {
        let elements = self.element_weight.iter().filter(|weight| **weight > 0.0).count();
        (self.train.iter().sum::<f64>() * elements as f64).max(1.0)
    }
}

/// What the errors of gains and baselines add, the shared numbers being known.
fn own_errors(elimination: &Elimination, fitted: &Total, predicted: &Total) -> f64 {
    let mut sum = 0.0;
    for (element, square) in elimination.gain_squares.iter().enumerate() {
        let gain = if *square > 0.0 { 1.0 / square } else { 0.0 };
        for (fitted, predicted) in fitted.segments.iter().zip(&predicted.segments) {
            let [one, mixed, _] = fitted.own[element];
            if one > 0.0 {
                // The baseline follows the gain's error, and has one of its own.
                let along = mixed / one;
                let [of_one, of_mixed, of_square] = predicted.own[element];
                sum += gain * (of_square - 2.0 * along * of_mixed + along * along * of_one) + of_one / one;
            }
        }
    }
    sum
}

/// What the errors of the shared numbers add, gains and baselines following them.
fn shared_errors(elimination: &Elimination, predicted: &Total) -> f64 {
    let count = elimination.reduced.nrows() - 1;
    let is_shown = |one: &usize| elimination.reduced[(*one, *one)] > SHOWN_LEAST * elimination.whole[*one];
    let shown: Vec<usize> = (0..count).filter(is_shown).collect();
    if shown.is_empty() {
        return 0.0;
    }
    let of = |matrix: &DMatrix<f64>| {
        DMatrix::from_fn(shown.len(), shown.len(), |i, j| matrix[(shown[i], shown[j])])
    };
    let left = left_of(elimination, predicted);
    // In units of each direction's size.
    let sizes: Vec<f64> = shown.iter().map(|one| elimination.whole[*one].sqrt()).collect();
    let scaled = |matrix: DMatrix<f64>| {
        DMatrix::from_fn(shown.len(), shown.len(), |i, j| matrix[(i, j)] / (sizes[i] * sizes[j]))
    };
    let Ok(covariance) = scaled(of(&elimination.reduced)).pseudo_inverse(SHOWN_LEAST) else { return 0.0 };
    (covariance * scaled(of(&left))).trace()
}

/// Products on the predicted readings of the directions less what the fitted gains and baselines take of them.
fn left_of(elimination: &Elimination, predicted: &Total) -> DMatrix<f64> {
    let mut left = predicted.products.clone();
    let gains = &elimination.gains;
    for (Border { by_baseline, by_gain, own }, of_segment) in
        predicted.segments.iter().zip(&elimination.baselines)
    {
        let last = gains.ncols();
        let baselines = DMatrix::from_fn(gains.nrows(), last, |element, number| {
            of_segment[(element, number)] - of_segment[(element, last)] * gains[(element, number)]
        });
        let taken = by_gain.transpose() * gains + by_baseline.transpose() * &baselines;
        left -= &taken + taken.transpose();
        let weighed = |of_gain: &dyn Fn([f64; 3]) -> f64, of_baseline: &dyn Fn([f64; 3]) -> f64| {
            DMatrix::from_fn(gains.nrows(), last, |element, number| {
                of_gain(own[element]) * gains[(element, number)]
                    + of_baseline(own[element]) * baselines[(element, number)]
            })
        };
        left += gains.transpose() * weighed(&|[.., square]| square, &|[_, mixed, _]| mixed);
        left += baselines.transpose() * weighed(&|[_, mixed, _]| mixed, &|[one, ..]| one);
    }
    left
}

#[cfg(test)]
#[path = "estimates_tests.rs"]
mod tests;
