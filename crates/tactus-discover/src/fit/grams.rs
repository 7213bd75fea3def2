//! Normal equations of many directions at once, from one pass over the data.
//!
//! [`super::sums`] adds up the products of all directions in one pass, [`super::elimination`] takes off what gains, baselines and the
//! model's own parameters fit. A step of a fit, the odds of any set of additions, and tests that flip the signs of blocks follow
//! without the data.

use nalgebra::DMatrix;

use super::elimination::{Elimination, Parts};
use super::folds::FOLDS;
use super::parameters::Parameters;
use super::problem::{Fitted, Problem};
use super::sparse::in_a_row;
use super::sums::{Direction, Directions, with_more_gain};
use super::totals::{Kept, Segments};
use crate::data::DiscoverError;

/// Products of directions at a model.
pub(crate) struct Grams {
    /// Products of the directions and, last, the residual, less what gains, baselines and the model's own parameters fit.
    reduced: DMatrix<f64>,
    /// Each direction's product with itself before that.
    whole: Vec<f64>,
    parts: Parts,
    /// The fold of each block, by presses.
    fold: Vec<usize>,
}

impl Problem<'_> {
    /// The products of directions at a fitted model. Those of the sparse columns of two groups are 0, but for those with the first group.
    pub(crate) fn grams<'a>(
        &self,
        at: &Fitted,
        directions: impl Into<Directions<'a>>,
    ) -> Result<Grams, DiscoverError> {
        self.products(at, directions.into(), Kept::AllAndBlocks)
    }

    /// As [`Self::grams`], without the products of two of the directions, which are 0: for tests of each by itself.
    pub(crate) fn grams_of_each<'a>(
        &self,
        at: &Fitted,
        directions: impl Into<Directions<'a>>,
    ) -> Result<Grams, DiscoverError> {
        self.products(at, directions.into(), Kept::OwnAndBlocks)
    }

    fn products(
        &self,
        at: &Fitted,
        Directions { each, sparse }: Directions<'_>,
        kept: Kept,
    ) -> Result<Grams, DiscoverError> {
        let mut all = self.own(&at.parameters);
        let own = all.len();
        let groups = in_a_row(each.len(), sparse.iter().map(|of| of.columns));
        all.extend(each.into_iter().map(|direction| direction.after(own)));
        let all = Directions { each: all, sparse };
        let segments = Segments::of(self, &at.parameters);
        let total = self.sums(&at.parameters, &at.predicted, all, own, kept, &segments)?;
        let mut elimination = Elimination::of(self, &total, &segments, &at.parameters);
        let coefficients = elimination.sweep(own);
        let parts = elimination.parts(&total.blocks, &coefficients);
        let left = elimination.reduced.nrows() - own;
        let mut reduced = elimination.reduced.view((own, own), (left, left)).clone_owned();
        if kept == Kept::OwnAndBlocks {
            for one in 0..left - 1 {
                reduced.view_mut((0, one), (one, 1)).fill(0.0);
                reduced.view_mut((one + 1, one), (left - 2 - one, 1)).fill(0.0);
                reduced[(one, left - 1)] = reduced[(left - 1, one)];
            }
        }
        for (nth, one) in groups.iter().enumerate().skip(1) {
            for other in &groups[nth + 1..] {
                reduced.view_mut((one.start, other.start), (one.len(), other.len())).fill(0.0);
                reduced.view_mut((other.start, one.start), (other.len(), one.len())).fill(0.0);
            }
        }
        let fold = self.press_of_blocks(&total.blocks).into_iter().map(|press| press % FOLDS).collect();
        Ok(Grams { reduced, whole: elimination.whole.split_off(own), parts, fold })
    }

    /// Sizes of directions at a model, less what gains, baselines and its own parameters fit: how many standard errors each is from 0.
    pub(crate) fn sizes(
        &self,
        at: &Parameters,
        predicted: &[f64],
        directions: Vec<Direction<'_>>,
    ) -> Result<Vec<f64>, DiscoverError> {
        let mut all = self.own(at);
        let own = all.len();
        all.extend(directions.into_iter().map(|direction| direction.after(own)));
        let mut elimination = self.eliminated(at, predicted, all)?;
        elimination.sweep(own);
        let last = elimination.reduced.nrows() - 1;
        Ok((own..last).map(|one| elimination.reduced[(one, one)].max(0.0).sqrt()).collect())
    }

    /// The residual of a model less what its own parameters, gains and baselines still fit of it: bin by bin, element by element. 0 for
    /// readings that are not fitted.
    pub(crate) fn left(&self, at: &Fitted) -> Result<Vec<f64>, DiscoverError> {
        let free = self.free(&at.parameters);
        let mut elimination = self.eliminated(&at.parameters, &at.predicted, self.own(&at.parameters))?;
        let coefficients = elimination.sweep(free.len());
        let taken: Vec<f64> = coefficients.column(free.len()).iter().copied().collect();
        let mut left = self.standing(&at.parameters, &at.predicted);
        for (one, taken) in free.iter().zip(&taken) {
            let slope = self.slope(&at.parameters, &at.predicted, *one)?;
            left.iter_mut().zip(slope).for_each(|(left, slope)| *left -= taken * slope);
        }
        let segments = Segments::of(self, &at.parameters);
        let by_gain = self.by_gain(at)?;
        let elements = self.predictor.bins.elements;
        let fitted = elimination.fitted(&taken);
        for (bin, left) in left.chunks_exact_mut(elements).enumerate() {
            for (element, left) in left.iter_mut().enumerate() {
                let [gain, baseline] = fitted(segments.of_bin[bin], element);
                let is_fitted = self.train[bin] > 0.0 && self.element_weight[element] > 0.0;
                *left -= gain * by_gain[bin * elements + element] + baseline;
                *left *= f64::from(u8::from(is_fitted));
            }
        }
        Ok(left)
    }

    /// Derivative of every reading by its element's gain.
    pub(super) fn by_gain(&self, at: &Fitted) -> Result<Vec<f64>, DiscoverError> {
        let (more, step) = with_more_gain(&at.parameters);
        let mut by_gain = self.predict(&more)?;
        by_gain.iter_mut().zip(&at.predicted).for_each(|(more, now)| *more = (*more - now) / step);
        Ok(by_gain)
    }

    /// The directions of a model's free parameters.
    pub(super) fn own(&self, at: &Parameters) -> Vec<Direction<'static>> {
        self.free(at).into_iter().map(|free| self.towards(at, free)).collect()
    }

    /// What gains and baselines fit of the directions of a fit and of the residual, and what is left.
    pub(super) fn eliminated(
        &self,
        at: &Parameters,
        predicted: &[f64],
        directions: Vec<Direction<'_>>,
    ) -> Result<Elimination, DiscoverError> {
        let segments = Segments::of(self, at);
        let own = directions.len();
        let total = self.sums(at, predicted, directions, own, Kept::All, &segments)?;
        Ok(Elimination::of(self, &total, &segments, at))
    }
}

impl Grams {
    /// The reduced products: of the directions, and with the residual as the last row and column.
    pub(crate) const fn reduced(&self) -> &DMatrix<f64> {
        &self.reduced
    }

    /// The reduced products of the first directions, and with the residual as the last row and column.
    pub(crate) fn first(&self, directions: usize) -> DMatrix<f64> {
        let last = self.reduced.nrows() - 1;
        let place = |number: usize| if number < directions { number } else { last };
        DMatrix::from_fn(directions + 1, directions + 1, |i, j| self.reduced[(place(i), place(j))])
    }

    /// A direction's size before the elimination.
    pub(crate) fn whole(&self, direction: usize) -> f64 {
        self.whole[direction].sqrt()
    }

    /// A direction's size.
    pub(crate) fn size(&self, direction: usize) -> f64 {
        self.reduced[(direction, direction)].max(0.0).sqrt()
    }

    /// The product of a direction and the residual.
    pub(crate) fn wanted(&self, direction: usize) -> f64 {
        self.reduced[(self.reduced.nrows() - 1, direction)]
    }

    /// Each block's product of a direction and the residual.
    pub(crate) fn along(&self, direction: usize) -> &[f64] {
        &self.parts.along[direction]
    }

    /// The reduced products of the presses that are not in a fold: with the residual as summed over their blocks, of the directions in
    /// proportion to their number.
    pub(crate) fn without(&self, fold: usize) -> DMatrix<f64> {
        let others = self.fold.iter().filter(|of| **of != fold).count() as f64;
        let mut products = &self.reduced * (others / self.fold.len().max(1) as f64);
        let last = products.nrows() - 1;
        for direction in 0..last {
            let along = self.along(direction).iter().zip(&self.fold);
            let wanted: f64 = along.filter(|(_, of)| **of != fold).map(|(one, _)| one).sum();
            products[(direction, last)] = wanted;
            products[(last, direction)] = wanted;
        }
        products
    }

    /// By how much steps along some directions, for each fold those that the others want, bring the model nearer to the presses of the fold:
    /// block by block. A block has its share of the steps' square as it has of the directions' own.
    pub(crate) fn gains<'a>(&self, steps: impl Fn(usize) -> &'a [(usize, f64)]) -> Vec<f64> {
        let own = |block: usize, steps: &[(usize, f64)]| -> f64 {
            steps.iter().map(|(direction, step)| step * step * self.squares(*direction)[block]).sum()
        };
        // The steps' square over the sum of the directions' own.
        let crowded = |fold| {
            let steps = steps(fold);
            let products = steps.iter().flat_map(|(one, step)| {
                steps.iter().map(move |(other, another)| step * another * self.reduced[(*one, *other)])
            });
            let of_all: f64 = (0..self.fold.len()).map(|block| own(block, steps)).sum();
            if of_all > 0.0 { products.sum::<f64>() / of_all } else { 0.0 }
        };
        let crowded: Vec<f64> = (0..FOLDS).map(crowded).collect();
        let gain = |(block, fold): (usize, &usize)| {
            let steps = steps(*fold);
            let along: f64 = steps.iter().map(|(one, step)| step * self.along(*one)[block]).sum();
            2.0 * along - crowded[*fold] * own(block, steps)
        };
        self.fold.iter().enumerate().map(gain).collect()
    }

    /// Each block's product of a direction with itself.
    pub(crate) fn squares(&self, direction: usize) -> &[f64] {
        &self.parts.squares[direction]
    }
}
