//! Elimination of gains and baselines, and of a model's own parameters, from products of directions.
//!
//! Gains and baselines act on one element each, so they are eliminated element by element (Schur complements), and the model's own
//! free parameters after them. What is left, the *reduced* products, answers every later question about sets of directions without
//! the data. Baselines that walk have a state for each segment of the time, tied to its neighbours by the walk's stiffness.
//!
//! # Source
//! Elimination of parameters: G. H. Golub and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413. Sweeps of a Gram matrix: J. H.
//! Goodnight, *Am. Stat.* 33 (1979) 149.

use nalgebra::{DMatrix, DVector};

use super::gains::GAIN_ERROR_MAX;
use super::parameters::Parameters;
use super::problem::Problem;
use super::totals::{Block, Segments, Total};
use crate::numbers::parallel;

/// A direction of which gains, baselines and the model's parameters fit all but this share is empty.
const OWN_LEAST: f64 = 1e-6;

/// Least share of a derivative's square that counts as the parameter's own in the damping. A parameter whose action gains
/// and baselines can nearly replace is thus kept from long steps.
const OWN_SHARE_LEAST: f64 = 1e-3;

/// What gains and baselines fit of each direction, and what is left of its products.
pub(super) struct Elimination {
    /// What the baselines alone fit of each direction and, last, of the gains', in each segment: element by element.
    pub(super) baselines: Vec<DMatrix<f64>>,
    /// The run of each segment.
    pub(super) run: Vec<usize>,
    /// Coefficients of the gains beside the baselines: element by element, direction by direction.
    pub(super) gains: DMatrix<f64>,
    /// Weighted square of each element's derivative by its gain, less what its baseline fits; 0 where the gain is not fitted.
    pub(super) gain_squares: Vec<f64>,
    /// Products of the directions and, last, the residual.
    pub(super) reduced: DMatrix<f64>,
    /// Each direction's product with itself before the elimination.
    pub(super) whole: Vec<f64>,
}

/// Each block's part of the products of each direction with the residual and with itself.
pub(super) struct Parts {
    pub(super) along: Vec<Vec<f64>>,
    pub(super) squares: Vec<Vec<f64>>,
}

/// Coefficients of gains and baselines in single precision, for parts of a test's statistic.
struct Coefficients {
    baselines: Vec<DMatrix<f32>>,
    gains: DMatrix<f32>,
}

impl Elimination {
    pub(super) fn of(problem: &Problem<'_>, total: &Total, segments: &Segments, at: &Parameters) -> Self {
        let elements = problem.predictor.bins.elements;
        let mut reduced = total.products.clone();
        let count = reduced.nrows();
        let whole = reduced.diagonal().as_slice().to_vec();
        let stretches = segments.run.len();
        let mut baselines = vec![DMatrix::zeros(elements, count + 1); stretches];
        let mut gains = DMatrix::zeros(elements, count);
        let mut gain_squares = vec![0.0; elements];
        let pinned = problem.pinned(at);
        for element in 0..elements {
            let mut border = DMatrix::zeros(stretches, count + 1);
            let mut diagonal = vec![0.0; stretches];
            let mut of_gain = DVector::<f64>::zeros(count);
            let mut gain_square = 0.0;
            for (stretch, of_segment) in total.segments.iter().enumerate() {
                let [one, mixed, square] = of_segment.own[element];
                diagonal[stretch] = one;
                border[(stretch, count)] = mixed;
                gain_square += square;
                border.view_mut((stretch, 0), (1, count)).copy_from(&of_segment.by_baseline.row(element));
                of_gain += of_segment.by_gain.row(element).transpose();
            }
            let fitted = solved(&diagonal, segments, &border);
            let taken = border.transpose() * &fitted;
            reduced -= taken.view((0, 0), (count, count));
            // The gain, beside the baselines.
            of_gain -= taken.view((0, count), (count, 1));
            gain_square -= taken[(count, count)];
            let has_gain = pinned[element].is_none() && gain_square * GAIN_ERROR_MAX * GAIN_ERROR_MAX > 1.0;
            if has_gain {
                reduced.ger(-1.0 / gain_square, &of_gain, &of_gain, 1.0);
                gains.set_row(element, &(of_gain / gain_square).transpose());
                gain_squares[element] = gain_square;
            }
            for (stretch, baselines) in baselines.iter_mut().enumerate() {
                baselines.set_row(element, &fitted.row(stretch));
            }
        }
        Self { baselines, run: segments.run.clone(), gains, gain_squares, reduced, whole }
    }

    /// The normal equations of the directions: their products, those with the residual, and the squares to which damping is relative.
    pub(super) fn equations(&self) -> (DMatrix<f64>, DVector<f64>, Vec<f64>) {
        let last = self.reduced.nrows() - 1;
        let gram = self.reduced.view((0, 0), (last, last)).clone_owned();
        let right = self.reduced.view((0, last), (last, 1)).column(0).clone_owned();
        let squares = (0..last).map(|one| gram[(one, one)].max(OWN_SHARE_LEAST * self.whole[one])).collect();
        (gram, right, squares)
    }

    /// The residual's weighted sum of squares, before and after gains and baselines fit it.
    pub(super) fn residual_squares(&self) -> [f64; 2] {
        let last = self.whole.len() - 1;
        [self.whole[last], self.reduced[(last, last)]]
    }

    /// What gain and baseline fit of the residual less `taken` times each direction, in a segment for an element.
    pub(super) fn fitted<'a>(&'a self, taken: &'a [f64]) -> impl Fn(usize, usize) -> [f64; 2] + 'a {
        let residual = self.gains.ncols() - 1;
        move |segment, element| {
            let gain = Self::left(&self.gains, residual, element, taken);
            let baselines = &self.baselines[segment];
            let baseline = Self::left(baselines, residual, element, taken);
            [gain, baseline - gain * baselines[(element, residual + 1)]]
        }
    }

    /// What a matrix of coefficients has for the residual less `taken` times each direction, for an element.
    pub(super) fn left(coefficients: &DMatrix<f64>, residual: usize, element: usize, taken: &[f64]) -> f64 {
        let of = |(number, taken): (usize, &f64)| taken * coefficients[(element, number)];
        coefficients[(element, residual)] - taken.iter().enumerate().map(of).sum::<f64>()
    }

    /// Eliminates the first `own` directions too. Returns their coefficients in every direction.
    pub(super) fn sweep(&mut self, own: usize) -> DMatrix<f64> {
        let count = self.reduced.nrows();
        let mut coefficients = DMatrix::<f64>::zeros(own, count);
        for one in 0..own {
            let pivot = self.reduced[(one, one)];
            // A direction that others contain is left out.
            if pivot <= OWN_LEAST * self.whole[one] {
                continue;
            }
            let row = self.reduced.row(one).clone_owned();
            let share = &row / pivot;
            for earlier in 0..one {
                let factor = coefficients[(earlier, one)];
                for number in one + 1..count {
                    coefficients[(earlier, number)] -= factor * share[number];
                }
            }
            coefficients.set_row(one, &share);
            self.reduced -= row.transpose() * share;
        }
        for number in own..count - 1 {
            if self.reduced[(number, number)] <= OWN_LEAST * self.whole[number] {
                self.reduced.row_mut(number).fill(0.0);
                self.reduced.column_mut(number).fill(0.0);
            }
        }
        coefficients
    }

    /// Each block's parts of the directions after the first `own`, less what gains, baselines and those first ones fit, whose
    /// coefficients a sweep has given.
    pub(super) fn parts(&self, blocks: &[Block], coefficients: &DMatrix<f64>) -> Parts {
        let (own, last) = (coefficients.nrows(), coefficients.ncols() - 1);
        let fitted = self.coefficients();
        // Of a block: the products of each direction with the residual and with itself.
        let of_block = |block: &Block| -> Vec<[f64; 2]> {
            let (rows, diagonal) = fitted.of_block(block, own);
            // The products of each direction and the residual, less what the model's own directions fit of the residual,
            let left = |number: usize| {
                rows[(own, number)]
                    - (0..own).map(|one| coefficients[(one, last)] * rows[(one, number)]).sum::<f64>()
            };
            let of_own: Vec<f64> = (0..own).map(left).collect();
            let of_direction = |number: usize| {
                // and less what they fit of the direction.
                let shares = coefficients.view((0, number), (own, 1));
                let taken: f64 = shares.iter().zip(&of_own).map(|(share, of)| share * of).sum();
                let mut square = diagonal[number];
                for (one, share) in shares.iter().enumerate() {
                    let of_others: f64 =
                        shares.iter().enumerate().map(|(other, another)| another * rows[(one, other)]).sum();
                    square += share * (of_others - 2.0 * rows[(one, number)]);
                }
                [left(number) - taken, square.max(0.0)]
            };
            (own..last).map(of_direction).collect()
        };
        let by_block = parallel::map(blocks, of_block);
        let all = |part: usize| -> Vec<Vec<f64>> {
            (0..last - own).map(|one| by_block.iter().map(|block| block[one][part]).collect()).collect()
        };
        Parts { along: all(0), squares: all(1) }
    }

    fn coefficients(&self) -> Coefficients {
        #[expect(clippy::cast_possible_truncation, reason = "parts of a test's statistic")]
        let single = |value: f64| value as f32;
        let count = self.gains.ncols();
        let beside_gains = |baselines: &DMatrix<f64>| {
            DMatrix::from_fn(baselines.nrows(), count, |element, number| {
                single(
                    baselines[(element, number)]
                        - baselines[(element, count)] * self.gains[(element, number)],
                )
            })
        };
        Coefficients {
            baselines: self.baselines.iter().map(beside_gains).collect(),
            gains: self.gains.map(single),
        }
    }
}

impl Coefficients {
    /// A block's products less what gains and baselines fit: of the model's own directions and the residual with all, and of each with
    /// itself.
    fn of_block(&self, block: &Block, own: usize) -> (DMatrix<f64>, Vec<f64>) {
        let (zero, gain) = (&self.baselines[block.segment], &self.gains);
        // Half of the quadratic part, so that both factors of a product together take it whole.
        let half = |element: usize, number: usize, [by_zero, by_gain]: [f64; 2]| {
            0.5 * (by_zero * f64::from(zero[(element, number)])
                + by_gain * f64::from(gain[(element, number)]))
        };
        #[expect(clippy::cast_possible_truncation, reason = "parts of a test's statistic")]
        let less = |sums: &DMatrix<f32>, of: fn([f64; 3]) -> [f64; 2]| {
            DMatrix::from_fn(sums.nrows(), sums.ncols(), |element, number| {
                sums[(element, number)] - half(element, number, of(block.own[element])) as f32
            })
        };
        let zero_sums = less(&block.by_baseline, |[one, mixed, _]| [one, mixed]);
        let gain_sums = less(&block.by_gain, |[_, mixed, square]| [mixed, square]);
        let last = zero.ncols() - 1;
        let number = |row: usize| if row < own { row } else { last };
        let pick = |of: &DMatrix<f32>| DMatrix::from_fn(of.nrows(), own + 1, |e, row| of[(e, number(row))]);
        let taken = pick(zero).transpose() * &zero_sums
            + pick(gain).transpose() * &gain_sums
            + pick(&zero_sums).transpose() * zero
            + pick(&gain_sums).transpose() * gain;
        let rows = (&block.rows - taken).map(f64::from);
        let diagonal = block.diagonal.iter().enumerate().map(|(number, whole)| {
            let taken = zero.column(number).dot(&zero_sums.column(number))
                + gain.column(number).dot(&gain_sums.column(number));
            f64::from(whole - 2.0 * taken)
        });
        (rows, diagonal.collect())
    }
}

/// Baselines fitted to the sums: constants, or walks tied from segment to segment.
fn solved(diagonal: &[f64], segments: &Segments, sums: &DMatrix<f64>) -> DMatrix<f64> {
    let mut fitted = sums.clone();
    let stretches = diagonal.len();
    let tie = |stretch: usize| {
        let is_one_run = stretch + 1 < stretches && segments.run[stretch] == segments.run[stretch + 1];
        if is_one_run { segments.stiffness } else { 0.0 }
    };
    let mut pivots = vec![0.0; stretches];
    for stretch in 0..stretches {
        let before = stretch.checked_sub(1).map_or(0.0, tie);
        pivots[stretch] = diagonal[stretch] + before + tie(stretch);
        if before > 0.0 {
            let factor = -before / pivots[stretch - 1];
            pivots[stretch] += factor * before;
            for number in 0..fitted.ncols() {
                fitted[(stretch, number)] -= factor * fitted[(stretch - 1, number)];
            }
        }
    }
    for stretch in (0..stretches).rev() {
        let after = tie(stretch);
        for number in 0..fitted.ncols() {
            let next = if after > 0.0 { after * fitted[(stretch + 1, number)] } else { 0.0 };
            let value = fitted[(stretch, number)] + next;
            fitted[(stretch, number)] = if pivots[stretch] > 0.0 { value / pivots[stretch] } else { 0.0 };
        }
    }
    fitted
}
