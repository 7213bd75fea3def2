//! Gains and baselines after a step of a fit.

use super::elimination::Elimination;
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

impl Problem<'_> {
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

    /// Moves gains and baselines to fit the residual less `taken` times each direction of a fit. A walk stays.
    pub(super) fn take_up(&self, fit: &Elimination, taken: &[f64], parameters: &mut Parameters) {
        let elements = fit.gain_squares.len();
        let residual = fit.gains.ncols() - 1;
        let declared = &self.predictor.known.response.sensitivity_counts_per_mm;
        let wanted: Vec<f64> = (0..elements)
            .map(|element| {
                let share = Elimination::left(&fit.gains, residual, element, taken);
                parameters.sensitivity[element] * (1.0 + share)
            })
            .collect();
        let fitted = (0..elements).filter(|one| fit.gain_squares[*one] > 0.0 && declared[*one] != 0.0);
        let ratios: Vec<f64> = fitted.map(|element| wanted[element] / declared[element]).collect();
        let typical = if ratios.is_empty() { 1.0 } else { median(&ratios) };
        let pinned = self.pinned(parameters);
        for element in 0..elements {
            let now = parameters.sensitivity[element];
            let bounds = GAIN_RATIOS.map(|ratio| ratio * typical * declared[element]);
            let (least, most) = (bounds[0].min(bounds[1]), bounds[0].max(bounds[1]));
            let wanted = if let Some(share) = pinned[element] {
                share * typical * declared[element]
            } else if fit.gain_squares[element] > 0.0 {
                wanted[element]
            } else {
                typical * declared[element]
            };
            let next = if least < most { wanted.clamp(least, most) } else { wanted };
            parameters.sensitivity[element] = next;
            if parameters.walk.is_some() {
                continue;
            }
            // The baselines' fit, corrected for the change of the gain.
            let by_gain = if now == 0.0 { 0.0 } else { next / now - 1.0 };
            for (baselines, run) in fit.baselines.iter().zip(&fit.run) {
                parameters.baseline[*run][element] += Elimination::left(baselines, residual, element, taken)
                    - by_gain * baselines[(element, residual + 1)];
            }
        }
    }

    /// A model with its walk fitted anew, if it has one, and its prediction.
    pub(super) fn settled(&self, mut at: Parameters) -> Result<(Parameters, Vec<f64>), DiscoverError> {
        let mut predicted = self.predict(&at)?;
        if at.walk.is_some() {
            let residual = self.standing(&at, &predicted);
            Baselines::of(self, &at).settle(&residual, &mut at);
            predicted = self.predict(&at)?;
        }
        Ok((at, predicted))
    }

    /// Moves the baselines of elements without weight to the mean of their readings, less what the model predicts of them.
    pub(super) fn centre_weightless(&self, parameters: &mut Parameters, predicted: &mut [f64]) {
        let bins = self.predictor.bins;
        let elements = bins.elements;
        for element in (0..elements).filter(|element| self.element_weight[*element] == 0.0) {
            let mut sums = vec![[0.0; 2]; bins.paths.len()];
            for (bin, weight) in self.train.iter().enumerate() {
                let place = bin * elements + element;
                let [sum, weights] = &mut sums[bins.run[bin]];
                *sum += weight * (bins.counts[place] - predicted[place]);
                *weights += weight;
            }
            let means: Vec<f64> =
                sums.iter().map(|[sum, weights]| if *weights > 0.0 { sum / weights } else { 0.0 }).collect();
            for (baseline, mean) in parameters.baseline.iter_mut().zip(&means) {
                baseline[element] += mean;
            }
            for (of_bin, run) in predicted.chunks_exact_mut(elements).zip(&bins.run) {
                of_bin[element] += means[*run];
            }
        }
    }
}
