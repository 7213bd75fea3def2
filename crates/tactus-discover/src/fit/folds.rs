//! What a model leaves of presses or of elements that its fit has not seen, by folds of the fitted presses.
//!
//! The presses are divided into five folds. For each, the model's parameters, gains and baselines are fitted to the other four, in the
//! linear approximation at the model that is fitted to all, and the weighted squares of what is left are summed over the blocks of the
//! fold. Both take only products of the directions, block by block, which one pass gives ([`super::sums`]).
//!
//! What changes with time, the same for all elements, may take any course between two presses, so that a press says little about the next.
//! Then the folds are of elements: what some of them tell is judged on the others, whose own gains and baselines are fitted.
//!
//! The presses that show a parameter may all be in one fold. So each parameter has a prior: the coefficients of a class that it had with
//! the evidence ([`Prior`]), and of any other parameter that it stays within the longest step of a fit.
//!
//! The same fits predict each reading of the presses that they have not seen ([`ByFolds`]), in the same approximation: what the data hardly
//! determine may take long steps, along which a prediction moves little to first order and much beyond.
//!
//! The held-out presses take no part.
//!
//! # Source
//! M. Stone, *J. R. Stat. Soc. B* 36 (1974) 111 (choice by cross-validation).

use nalgebra::DMatrix;

use super::elimination::Elimination;
use super::estimates::errors;
use super::knots::{bounded, is_of_run_time};
use super::parameters::{Parameters, Term};
use super::problem::{Fitted, Free, Problem, least_step};
use super::tiles::add;
use super::totals::{Block, Kept, Segments, Total};
use crate::data::DiscoverError;
use crate::numbers::{NORMAL_PER_MEDIAN, median};

/// Number of folds. The fit of each has four fifths of the presses or elements.
pub(crate) const FOLDS: usize = 5;
/// Greatest part of a block, in standard deviations; in sums under flipped signs, too.
pub(crate) const CLIP: f64 = 4.0;

/// What folds are made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum FoldsOf {
    Presses,
    Elements,
}

impl FoldsOf {
    /// Those that can confirm an effect: a line in the run's time is the same for all elements.
    pub(crate) fn effect(term: &Term) -> Self {
        if term.curve().is_some_and(is_of_run_time) { Self::Elements } else { Self::Presses }
    }
}

/// What is known of a parameter before a fold is fitted: a normal density, on the parameter's [scale](super::scale::Scale).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Prior {
    /// Where it is centred, counted from the parameter's value.
    centre: f64,
    precision: f64,
}

/// What is known of all free parameters before a fold is fitted.
struct Known {
    priors: Vec<Prior>,
    /// The least steps that their classes allow.
    least: Vec<f64>,
}

impl Known {
    /// The steps that some folds want.
    fn steps(&self, others: &Elimination) -> Vec<f64> {
        let (mut gram, mut right, mut squares) = others.equations();
        for (one, Prior { centre, precision }) in self.priors.iter().enumerate() {
            gram[(one, one)] += precision;
            right[one] += precision * centre;
            squares[one] = gram[(one, one)].max(squares[one]);
        }
        bounded(&gram, &right, 0.0, &squares, &self.least).as_slice().to_vec()
    }
}

/// A model whose fitted presses are predicted by fits to other presses: each of five folds by that to the others.
pub(crate) struct ByFolds {
    /// By how much this moves what the fit to all predicts: bin by bin, element by element. 0 for bins that are not fitted.
    pub(crate) moved: Vec<f64>,
    /// Mean square of the errors that estimated numbers make there, in units of the noise's variance.
    pub(crate) estimation_error: f64,
}

/// What all fits to folds of presses are made from.
struct OfPresses {
    known: Known,
    segments: Segments,
    blocks: Vec<Block>,
    /// The press of each block.
    press: Vec<usize>,
    /// Number of free parameters.
    count: usize,
}

/// A fit to all folds of presses but one.
struct Fold {
    /// The sums over the others, and what gains and baselines fit of theirs.
    others: Total,
    fitted: Elimination,
    /// The steps that they want.
    steps: Vec<f64>,
}

impl OfPresses {
    /// True if a block is one of a fold's.
    fn is_in(&self, block: usize, fold: usize) -> bool {
        self.press[block] % FOLDS == fold
    }

    /// The sums over the blocks that are in a fold, or not.
    fn sum(&self, problem: &Problem<'_>, fold: usize, is_in: bool) -> Total {
        let blocks = self.blocks.iter().enumerate().filter(|(block, _)| self.is_in(*block, fold) == is_in);
        sum(blocks.map(|(_, block)| block), self.count, &self.segments, problem)
    }

    fn without(&self, problem: &Problem<'_>, at: &Fitted, fold: usize) -> Fold {
        let others = self.sum(problem, fold, false);
        let fitted = Elimination::of(problem, &others, &self.segments, &at.parameters);
        let steps = self.known.steps(&fitted);
        Fold { others, fitted, steps }
    }
}

impl Problem<'_> {
    /// The weighted squares of what a model leaves, block by block, each predicted by a fit to the other folds. `None` for models with
    /// random walks, which have a state of their own in every press.
    pub(crate) fn left_by_folds(
        &self,
        at: &Fitted,
        folds: FoldsOf,
    ) -> Result<Option<Vec<f64>>, DiscoverError> {
        if at.parameters.walk.is_some() {
            return Ok(None);
        }
        match folds {
            FoldsOf::Presses => self.left_by_presses(at).map(Some),
            FoldsOf::Elements => self.left_by_elements(at).map(Some),
        }
    }

    /// A model with each fold of the fitted presses predicted by a fit to the others. `None` for models with random walks.
    pub(crate) fn by_folds(&self, at: &Fitted) -> Result<Option<ByFolds>, DiscoverError> {
        if at.parameters.walk.is_some() {
            return Ok(None);
        }
        let of_presses = self.of_presses(at)?;
        let folds: Vec<Fold> = (0..FOLDS).map(|fold| of_presses.without(self, at, fold)).collect();
        let squares = folds.iter().enumerate().map(|(number, Fold { others, fitted, .. })| {
            errors(fitted, others, &of_presses.sum(self, number, true))
        });
        let estimation_error = self.variance * squares.sum::<f64>() / self.weighed_readings();
        let bins = self.predictor.bins;
        let fold_of = |bin: usize| {
            let block = of_presses.blocks.partition_point(|block| block.first_bin <= bin).checked_sub(1);
            block.filter(|_| !bins.heldout[bin]).map(|block| of_presses.press[block] % FOLDS)
        };
        let unseen: Vec<(usize, usize)> =
            (0..bins.len()).filter_map(|bin| Some((bin, fold_of(bin)?))).collect();
        let readings = |bin: usize| bin * bins.elements..(bin + 1) * bins.elements;
        let mut moved = vec![0.0; at.predicted.len()];
        for (number, one) in self.free(&at.parameters).into_iter().enumerate() {
            let slope = self.slope(&at.parameters, &at.predicted, one)?;
            for (bin, fold) in &unseen {
                let step = folds[*fold].steps[number];
                let of_bin = moved[readings(*bin)].iter_mut().zip(&slope[readings(*bin)]);
                of_bin.for_each(|(moved, slope)| *moved += step * slope);
            }
        }
        let by_gain = self.by_gain(at)?;
        let element: Vec<_> = folds.iter().map(|fold| fold.fitted.fitted(&fold.steps)).collect();
        for (bin, fold) in &unseen {
            let of_bin = moved[readings(*bin)].iter_mut().zip(&by_gain[readings(*bin)]).enumerate();
            for (number, (moved, by_gain)) in of_bin {
                let [gain, baseline] = element[*fold](of_presses.segments.of_bin[*bin], number);
                *moved += gain * by_gain + baseline;
            }
        }
        Ok(Some(ByFolds { moved, estimation_error }))
    }

    fn of_presses(&self, at: &Fitted) -> Result<OfPresses, DiscoverError> {
        let own = self.own(&at.parameters);
        let count = own.len();
        let segments = Segments::of(self, &at.parameters);
        let total = self.sums(&at.parameters, &at.predicted, own, count, Kept::AllAndBlocks, &segments)?;
        let press = self.press_of_blocks(&total.blocks);
        Ok(OfPresses { known: self.known(&at.parameters), segments, blocks: total.blocks, press, count })
    }

    fn left_by_presses(&self, at: &Fitted) -> Result<Vec<f64>, DiscoverError> {
        let of_presses = self.of_presses(at)?;
        let mut left = vec![0.0; of_presses.blocks.len()];
        for fold in 0..FOLDS {
            let Fold { fitted, steps, .. } = of_presses.without(self, at, fold);
            let element = fitted.fitted(&steps);
            let blocks = of_presses.blocks.iter().zip(&mut left).enumerate();
            for (_, (block, left)) in blocks.filter(|(number, _)| of_presses.is_in(*number, fold)) {
                *left = left_of(block, &steps, |number| element(block.segment, number));
            }
        }
        Ok(left)
    }

    fn left_by_elements(&self, at: &Fitted) -> Result<Vec<f64>, DiscoverError> {
        let known = self.known(&at.parameters);
        let segments = Segments::of(self, &at.parameters);
        let of_fold = |fold: usize| -> Result<Total, DiscoverError> {
            // All free parameters, those of wires that only other folds show as well.
            let own = self.own(&at.parameters);
            let count = own.len();
            let of = self.of_elements(|element| element % FOLDS == fold);
            of.sums(&at.parameters, &at.predicted, own, count, Kept::AllAndBlocks, &segments)
        };
        let folds: Vec<Total> = (0..FOLDS).map(of_fold).collect::<Result<_, DiscoverError>>()?;
        let mut left = vec![0.0; folds[0].blocks.len()];
        for (fold, of_fold) in folds.iter().enumerate() {
            let others = folds.iter().enumerate().filter(|(other, _)| *other != fold);
            let others = others.map(|(_, total)| total).fold(of_fold.none(), Total::joined);
            let steps = known.steps(&Elimination::of(self, &others, &segments, &at.parameters));
            // The elements' own gains and baselines are nobody else's.
            let own = Elimination::of(self, of_fold, &segments, &at.parameters);
            let element = own.fitted(&steps);
            for (left, block) in left.iter_mut().zip(&of_fold.blocks) {
                *left += left_of(block, &steps, |number| element(block.segment, number));
            }
        }
        Ok(left)
    }

    fn known(&self, at: &Parameters) -> Known {
        let least = self.free(at).iter().map(|one| least_step(at, *one)).collect();
        Known { priors: self.priors(at), least }
    }

    /// The priors of a model's free parameters. Coefficients that are 0 without their class have one variance for the class, as in the
    /// odds: that of their values, in units of their widths. Several are pulled towards 0; a single one is its own variance.
    fn priors(&self, at: &Parameters) -> Vec<Prior> {
        let free = self.free(at);
        // Of a coefficient: its class, and its value and width.
        let coefficient = |one: &Free| match *one {
            Free::Of { term, parameter } => {
                let of = &at.terms[term];
                let known = &of.definition.parameters[parameter];
                let width = self.scale_of(known).width();
                (known.neutral == 0.0).then(|| (of.definition.name, of.values[parameter], width))
            }
            Free::Knot { term, knot } => {
                let of = &at.terms[term];
                let (value, width) = of.knot(knot)?;
                Some((of.definition.name, value, if of.tables.is_empty() { 1.0 } else { width }))
            }
            Free::SigmaIntercept | Free::SigmaSlope | Free::RunGain { .. } => None,
        };
        let coefficients: Vec<_> = free.iter().map(coefficient).collect();
        let prior = |(one, coefficient): (&Free, &Option<(&str, f64, f64)>)| match (*one, coefficient) {
            (_, Some((class, value, width))) => {
                let of_class = coefficients.iter().flatten().filter(|(of, ..)| of == class);
                let squares: Vec<f64> = of_class.map(|(_, value, width)| (value / width).powi(2)).collect();
                let mean = squares.iter().sum::<f64>() / squares.len() as f64;
                let variance = (mean * width * width).max(f64::MIN_POSITIVE);
                let is_pulled = squares.len() > 1 && matches!(one, Free::Of { .. });
                Prior { centre: if is_pulled { -value } else { 0.0 }, precision: 1.0 / variance }
            }
            (Free::Of { term, parameter }, None) => {
                let known = &at.terms[term].definition.parameters[parameter];
                let stride = self.scale_of(known).stride_max();
                Prior { centre: 0.0, precision: 1.0 / (stride * stride) }
            }
            (Free::SigmaIntercept | Free::SigmaSlope | Free::RunGain { .. } | Free::Knot { .. }, None) => {
                Prior { centre: 0.0, precision: 0.0 }
            }
        };
        free.iter().zip(&coefficients).map(prior).collect()
    }

    /// The press of each block, counted from 0 in order of time. Where many short blocks are joined, that of the first.
    pub(super) fn press_of_blocks(&self, blocks: &[Block]) -> Vec<usize> {
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

/// By how much a model that leaves `more` is nearer than one that leaves `less` to presses that a fit to the others predicts, block by
/// block, in units of the noise's variance. A block counts at most four standard deviations of those that tell something: the press at the
/// end of a drift, for example, is out of reach for a fit to the others. Where the models differ by less than the noise of one number, as
/// far from contact, a block tells nothing, and such blocks must not set the scale.
pub(crate) fn gains_by_folds(less: &[f64], more: &[f64]) -> Vec<f64> {
    let gains: Vec<f64> = less.iter().zip(more).map(|(less, more)| less - more).collect();
    let sizes = gains.iter().map(|gain| gain.abs());
    let telling: Vec<f64> = sizes.filter(|size| *size >= 1.0).collect();
    let most = if telling.is_empty() { 1.0 } else { CLIP * NORMAL_PER_MEDIAN * median(&telling) };
    gains.into_iter().map(|gain| gain.clamp(-most, most)).collect()
}

/// The sums over some blocks.
fn sum<'a>(
    blocks: impl Iterator<Item = &'a Block>,
    own: usize,
    segments: &Segments,
    problem: &Problem<'_>,
) -> Total {
    let elements = problem.predictor.bins.elements;
    let mut total = Total::new(own + 1, elements, segments.run.len());
    for block in blocks {
        total.products += block.rows.map(f64::from);
        let border = &mut total.segments[block.segment];
        border.by_baseline += block.by_baseline.map(f64::from);
        border.by_gain += block.by_gain.map(f64::from);
        add(&mut border.own, &block.own);
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
