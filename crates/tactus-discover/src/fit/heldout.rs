//! Residuals of a model on the held-out bins and on all bins, block by block.

use super::problem::{Fitted, Problem};

/// A remainder counts as certain beyond this many standard errors.
const SURE_Z: f64 = 2.0;
/// Readings have a signal above this number of noise standard deviations.
pub(crate) const LOUD: f64 = 5.0;

/// Sum of squared residuals on the held-out bins less that of the noise, in units of the noise variance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldOutGap {
    pub(crate) value: f64,
    /// Standard error of `value` from the noise alone, not from errors of the model.
    pub(crate) error: f64,
}

impl HeldOutGap {
    /// The gap less the uncertainty of the noise; not negative.
    pub(crate) fn sure(self) -> f64 {
        (self.value - SURE_Z * self.error).max(0.0)
    }
}

impl Problem<'_> {
    /// Weighted sum of squared residuals and number of readings of the held-out bins, for each block.
    fn heldout_blocks(&self, predicted: &[f64]) -> Vec<[f64; 2]> {
        let heldout = &self.predictor.bins.heldout;
        self.blocks_of(predicted, |bin| heldout[bin])
    }

    fn blocks_of(&self, predicted: &[f64], among: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
        let bins = self.predictor.bins;
        let elements = bins.elements;
        let weighed = self.weighed_elements();
        let mut blocks = vec![[0.0; 2]; bins.blocks];
        let of_bins = bins.counts.chunks_exact(elements).zip(predicted.chunks_exact(elements)).enumerate();
        for (bin, (counts, predicted)) in of_bins.filter(|(bin, _)| among(*bin)) {
            let squares = counts.iter().zip(predicted).zip(&self.element_weight);
            let sum: f64 = squares.map(|((counts, of), weight)| weight * (counts - of).powi(2)).sum();
            let [total, readings] = &mut blocks[bins.block[bin]];
            *total += bins.weight[bin] * sum;
            *readings += if bins.weight[bin] > 0.0 { weighed } else { 0.0 };
        }
        blocks
    }

    /// Number of elements with weight: faulty ones have none.
    fn weighed_elements(&self) -> f64 {
        self.element_weight.iter().filter(|weight| **weight > 0.0).count() as f64
    }

    /// By how much `more` is nearer to the held-out bins than `less`, block by block.
    pub(crate) fn heldout_gains(&self, less: &[f64], more: &[f64]) -> Vec<f64> {
        let both = self.heldout_blocks(less).into_iter().zip(self.heldout_blocks(more));
        both.map(|([less, _], [more, _])| less - more).collect()
    }

    /// By how much `more` is nearer to the fitted bins than `less`, in every other block and in the others.
    pub(crate) fn fitted_halves(&self, less: &Fitted, more: &Fitted) -> [f64; 2] {
        let of = |fitted: &Fitted| self.blocks_of(&fitted.predicted, |bin| self.train[bin] > 0.0);
        let [less, more] = [of(less), of(more)];
        let fitted = less.iter().zip(&more).filter(|([_, readings], _)| *readings > 0.0);
        let mut halves = [0.0; 2];
        for (block, ([less, _], [more, _])) in fitted.enumerate() {
            halves[block % 2] += less - more;
        }
        halves
    }

    /// Coefficient of a column in the residual of all bins, and its standard error from the scatter of blocks.
    pub(crate) fn share(&self, column: &[f64], predicted: &[f64]) -> Option<[f64; 2]> {
        let bins = self.predictor.bins;
        let mut blocks = vec![[0.0; 2]; bins.blocks];
        for (index, ((value, counts), of)) in column.iter().zip(&bins.counts).zip(predicted).enumerate() {
            if *value != 0.0 {
                let (bin, element) = (index / bins.elements, index % bins.elements);
                let weighted = bins.weight[bin] * self.element_weight[element] * value;
                let [along, squares] = &mut blocks[bins.block[bin]];
                *along += weighted * (counts - of);
                *squares += weighted * value;
            }
        }
        let squares: f64 = blocks.iter().map(|[_, squares]| squares).sum();
        let share = blocks.iter().map(|[along, _]| along).sum::<f64>() / squares;
        let scatter: f64 = blocks.iter().map(|[along, squares]| (along - share * squares).powi(2)).sum();
        (squares > 0.0).then(|| [share, scatter.sqrt() / squares])
    }

    /// Root mean square of the residuals of the elements with weight in the held-out frames, each predicted as its bin is, or
    /// along the way of its bin.
    pub(crate) fn heldout_rms_counts(&self, predicted: &[f64]) -> f64 {
        let (bins, frames) = (self.predictor.bins, self.predictor.frames);
        let (mut sum, mut readings) = (0.0, 0.0);
        for bin in (0..bins.len()).filter(|bin| bins.heldout[*bin]) {
            let weighed = (0..bins.elements).filter(|element| self.element_weight[*element] > 0.0);
            let weighed: Vec<(usize, f64)> =
                weighed.map(|element| (element, bins.slope_per_s(predicted, bin, element))).collect();
            for frame in bins.first[bin]..bins.first[bin + 1] {
                let (counts, after_s) = (frames.counts_of(frame), frames.t_s[frame] - bins.t_s[bin]);
                let residual = |(element, slope): &(usize, f64)| {
                    f64::from(counts[*element]) - predicted[bin * bins.elements + element] - slope * after_s
                };
                sum += weighed.iter().map(|one| residual(one).powi(2)).sum::<f64>();
                readings += weighed.len() as f64;
            }
        }
        if readings > 0.0 { (sum / readings).sqrt() } else { 0.0 }
    }

    /// The gap of a model on the held-out bins.
    pub(crate) fn heldout_gap(&self, predicted: &[f64]) -> HeldOutGap {
        let blocks = self.heldout_blocks(predicted);
        let value = blocks.iter().map(|[squares, readings]| squares - readings).sum();
        let variance: f64 = blocks.iter().map(|[_, readings]| 2.0 * readings).sum();
        HeldOutGap { value, error: variance.sqrt() }
    }
}
