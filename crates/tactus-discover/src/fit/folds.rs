//! What a model leaves of presses that its fit has not seen, by folds of the fitted presses.
//!
//! The presses are divided into five folds. For each, the model's parameters, gains and baselines are fitted to the other four, in the
//! linear approximation at the model that is fitted to all, and the weighted squares of what is left are summed over the presses of the
//! fold. Both take only products of the directions, block by block, which one pass gives ([`super::sums`]).
//!
//! The held-out presses take no part.
//!
//! # Source
//! M. Stone, *J. R. Stat. Soc. B* 36 (1974) 111 (choice by cross-validation).

use nalgebra::DMatrix;

use super::elimination::Elimination;
use super::problem::{Fitted, Problem};
use super::sums::{Block, Border, Kept, Segments, Total};
use crate::data::DiscoverError;

/// Number of folds. The fit of each has four fifths of the presses.
const FOLDS: usize = 5;

impl Problem<'_> {
    /// By how much `more` is nearer than `less` to the fitted presses that a fit to the others predicts, press by press, in units of the
    /// noise's variance. `None` for models with random walks, which have a state of their own in every press.
    pub(crate) fn gains_by_folds(
        &self,
        less: &Fitted,
        more: &Fitted,
    ) -> Result<Option<Vec<f64>>, DiscoverError> {
        let Some((less, more)) = self.left_by_folds(less)?.zip(self.left_by_folds(more)?) else {
            return Ok(None);
        };
        Ok(Some(less.iter().zip(&more).map(|(less, more)| less - more).collect()))
    }

    /// The weighted squares of what a model leaves, press by press, each predicted by a fit to the other folds.
    fn left_by_folds(&self, at: &Fitted) -> Result<Option<Vec<f64>>, DiscoverError> {
        if at.parameters.walk.is_some() {
            return Ok(None);
        }
        let own = self.own(&at.parameters);
        let count = own.len();
        let segments = Segments::of(self, &at.parameters);
        let total = self.sums(&at.parameters, &at.predicted, own, count, Kept::AllAndBlocks, &segments)?;
        let press = self.press_of_blocks(&total.blocks);
        let mut left = vec![0.0; press.iter().max().map_or(0, |last| last + 1)];
        for fold in 0..FOLDS {
            let is_in = |press: usize| press % FOLDS == fold;
            let others = total.blocks.iter().zip(&press).filter(|(_, press)| !is_in(**press));
            let others = sum(others.map(|(block, _)| block), count, &segments, self);
            let mut fitted = Elimination::of(self, &others, &segments, &at.parameters);
            let steps: Vec<f64> = fitted.sweep(count).column(count).iter().copied().collect();
            let element = fitted.fitted(&steps);
            for (block, press) in total.blocks.iter().zip(&press).filter(|(_, press)| is_in(**press)) {
                left[*press] += left_of(block, &steps, |number| element(block.segment, number));
            }
        }
        Ok(Some(left))
    }

    /// The press of each block, counted from 0 in order of time. Where many short blocks are joined, that of the first.
    fn press_of_blocks(&self, blocks: &[Block]) -> Vec<usize> {
        let (bins, frames) = (self.predictor.bins, self.predictor.frames);
        let mut presses: Vec<usize> = Vec::with_capacity(blocks.len());
        let mut before = None;
        for block in blocks {
            let key = (bins.run[block.first_bin], frames.press[bins.first[block.first_bin]]);
            let last = presses.last().copied();
            presses.push(match last {
                None => 0,
                Some(last) if before == Some(key) => last,
                Some(last) => last + 1,
            });
            before = Some(key);
        }
        presses
    }
}

/// The sums over some blocks.
fn sum<'a>(
    blocks: impl Iterator<Item = &'a Block>,
    own: usize,
    segments: &Segments,
    problem: &Problem<'_>,
) -> Total {
    let elements = problem.predictor.bins.elements;
    let mut total = Total {
        products: DMatrix::zeros(own + 1, own + 1),
        segments: vec![Border::new(own + 1, elements); segments.run.len()],
        blocks: Vec::new(),
    };
    for block in blocks {
        total.products += block.rows.map(f64::from);
        let border = &mut total.segments[block.segment];
        border.by_baseline += block.by_baseline.map(f64::from);
        border.by_gain += block.by_gain.map(f64::from);
        for (sum, of) in border.own.iter_mut().flatten().zip(block.own.iter().flatten()) {
            *sum += of;
        }
    }
    total
}

/// The weighted squares of a block's residual less `steps` along the directions, and less what gain and baseline of each element fit.
fn left_of(block: &Block, steps: &[f64], element: impl Fn(usize) -> [f64; 2]) -> f64 {
    let residual = steps.len();
    // The residual takes part with a factor of 1, each direction with minus its step.
    let factor = |number: usize| if number == residual { 1.0 } else { -steps[number] };
    let numbers = 0..=residual;
    let mut left = 0.0;
    for one in numbers.clone() {
        let row = numbers.clone().map(|other| factor(other) * f64::from(block.rows[(one, other)]));
        left += factor(one) * row.sum::<f64>();
    }
    for (number, [one, mixed, square]) in block.own.iter().enumerate() {
        let [gain, baseline] = element(number);
        let along = |sums: &DMatrix<f32>| -> f64 {
            numbers.clone().map(|of| factor(of) * f64::from(sums[(number, of)])).sum()
        };
        left -= 2.0 * (gain * along(&block.by_gain) + baseline * along(&block.by_baseline));
        left += gain * gain * square + 2.0 * gain * baseline * mixed + baseline * baseline * one;
    }
    left
}

#[cfg(test)]
#[path = "folds_tests.rs"]
mod tests;
