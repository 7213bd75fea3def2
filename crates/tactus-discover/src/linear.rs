//! Gains and baselines eliminated: what of a residual or a derivative they cannot take up.

use crate::DiscoverError;
use crate::fit::Problem;
use crate::noise::median;
use crate::predictor::Parameters;
use crate::random_walk::Baselines;

/// Recalibration moves an element's gain within these, as ratios to what is typical of the array: an element beyond is
/// not an element of another gain.
const GAIN_RATIOS: [f64; 2] = [0.25, 4.0];
/// So near to an end a gain is at it.
const PIN_MARGIN: f64 = 0.02;
/// An element whose reading tells its gain worse than this share keeps its declared gain.
const GAIN_ERROR_MAX: f64 = 0.3;

/// Derivatives at a point, freed of gains and baselines.
pub(crate) struct Linear<'a> {
    problem: &'a Problem<'a>,
    baselines: Baselines<'a>,
    /// Of the counts by each element's relative gain, freed of the zeros.
    by_gain: Vec<f64>,
    /// What the zeros took up of it: run by run, knot by knot.
    by_gain_taken: Vec<Vec<f64>>,
    /// Of every element, the weighted sum of squares of that; 0 where the gain is not free.
    by_gain_squares: Vec<f64>,
}

impl<'a> Problem<'a> {
    /// Derivatives at a point.
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
            if *pinned || *squares * GAIN_ERROR_MAX * GAIN_ERROR_MAX < 1.0 {
                *squares = 0.0;
            }
        }
        Ok(Linear { problem: self, baselines, by_gain, by_gain_taken, by_gain_squares })
    }

    /// Elements whose gain has come to the end of what recalibration may give it: there it stays, for an effect to explain.
    fn pinned(&self, at: &Parameters) -> Vec<bool> {
        let declared = &self.predictor.known.response.sensitivity_counts_per_mm;
        let ratios: Vec<f64> =
            at.sensitivity.iter().zip(declared).map(|(now, declared)| now / declared).collect();
        let typical = median(&ratios);
        ratios
            .iter()
            .map(|ratio| {
                let share = ratio / typical;
                share <= GAIN_RATIOS[0] * (1.0 + PIN_MARGIN) || share >= GAIN_RATIOS[1] * (1.0 - PIN_MARGIN)
            })
            .collect()
    }
}

impl Linear<'_> {
    /// Frees a column, bin by bin and element by element, of what gains and baselines can take up.
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

    /// The relative change of each gain that best takes up a column.
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

    /// Moves gains and zeros so that they take up what is left if the zeros stand still.
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
        for element in (0..elements).filter(|element| !pinned[*element]) {
            let now = parameters.sensitivity[element];
            let bounds = GAIN_RATIOS.map(|ratio| ratio * typical * declared[element]);
            let (least, most) = (bounds[0].min(bounds[1]), bounds[0].max(bounds[1]));
            let wanted = if self.by_gain_squares[element] > 0.0 {
                now * (1.0 + shares[element])
            } else {
                typical * declared[element]
            };
            let next = if least < most { wanted.clamp(least, most) } else { wanted };
            taken[element] = if now == 0.0 { 0.0 } else { next / now - 1.0 };
            parameters.sensitivity[element] = next;
        }
        // What the zeros take up, less what the gains' change has moved of it.
        for (baselines, by_gain) in baselines.iter_mut().zip(&self.by_gain_taken) {
            for ((zero, by_gain), taken) in baselines.iter_mut().zip(by_gain).zip(taken.iter().cycle()) {
                *zero -= taken * by_gain;
            }
        }
        self.baselines.put(baselines, parameters);
    }
}
