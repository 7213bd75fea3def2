//! Normal equations of many directions at once, from one pass over the data.
//!
//! [`super::sums`] adds up the products of all directions in one pass, [`super::elimination`] takes off what gains, baselines and the
//! model's own parameters fit. A step of a fit, the odds of any set of additions, and tests that flip the signs of blocks follow
//! without the data.

use nalgebra::DMatrix;

use super::elimination::{Elimination, Parts};
use super::parameters::Parameters;
use super::problem::{Fitted, Problem};
use super::sums::{Direction, with_more_gain};
use super::totals::{Kept, Segments};
use crate::data::DiscoverError;

/// Products of directions at a model.
pub(crate) struct Grams {
    /// Products of the directions and, last, the residual, less what gains, baselines and the model's own parameters fit.
    reduced: DMatrix<f64>,
    /// Each direction's product with itself before that.
    whole: Vec<f64>,
    parts: Parts,
}

impl Problem<'_> {
    /// The products of directions at a fitted model.
    pub(crate) fn grams(&self, at: &Fitted, directions: Vec<Direction<'_>>) -> Result<Grams, DiscoverError> {
        self.products(at, directions, Kept::AllAndBlocks)
    }

    /// As [`Self::grams`], without the products of two of the directions, which are 0: for tests of each by itself.
    pub(crate) fn grams_of_each(
        &self,
        at: &Fitted,
        directions: Vec<Direction<'_>>,
    ) -> Result<Grams, DiscoverError> {
        self.products(at, directions, Kept::OwnAndBlocks)
    }

    fn products(
        &self,
        at: &Fitted,
        directions: Vec<Direction<'_>>,
        kept: Kept,
    ) -> Result<Grams, DiscoverError> {
        let mut all = self.own(&at.parameters);
        let own = all.len();
        all.extend(directions.into_iter().map(|direction| direction.after(own)));
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
        Ok(Grams { reduced, whole: elimination.whole.split_off(own), parts })
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
        let (more, step) = with_more_gain(&at.parameters);
        let mut by_gain = self.predict(&more)?;
        by_gain.iter_mut().zip(&at.predicted).for_each(|(more, now)| *more = (*more - now) / step);
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

    /// Each block's product of a direction with itself.
    pub(crate) fn squares(&self, direction: usize) -> &[f64] {
        &self.parts.squares[direction]
    }
}
