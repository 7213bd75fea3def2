//! Normal equations of many directions at once, from one pass over the data.
//!
//! A direction is the derivative of the prediction by one number: a free parameter of the model, an amplitude of a term that the
//! model does not have, or a column that belongs to no effect. All directions are computed together, a few hundred bins at a
//! time, and only their products are kept:
//!
//! ```text
//! A = sum over bins and elements of w x x'        x: all directions, and the residual as the last
//! ```
//!
//! Gains and baselines act on one element each, so they are eliminated element by element (Schur complements), and the model's own
//! free parameters after them. What is left, the *reduced* products, answers every later question about sets of directions without
//! the data. Baselines that walk have a state for each segment of the time, tied to its neighbours by the walk's stiffness.
//!
//! For tests that flip signs, each block's part of the product of a direction and the residual is kept too, both less what the
//! eliminated parameters fit.
//!
//! # Source
//! Elimination of parameters: G. H. Golub and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413. Sweeps of a Gram matrix: J. H.
//! Goodnight, *Am. Stat.* 33 (1979) 149.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use nalgebra::{DMatrix, DVector};

use super::linear::GAIN_ERROR_MAX;
use super::parameters::Parameters;
use super::predictor::Stream;
use super::problem::{Fitted, Problem};
use super::random_walk::is_random_walk;
use crate::data::DiscoverError;
use crate::numbers::parallel;

/// Bins of which all directions are held at a time.
const CHUNK_BINS: usize = 256;
/// Greatest number of blocks whose signs are flipped apart; more are joined.
const BLOCKS_MAX: usize = 400;
/// A direction of which gains, baselines and the model's parameters fit all but this share is empty.
const OWN_LEAST: f64 = 1e-6;

/// A direction.
pub(crate) enum Direction<'a> {
    /// Finite difference towards a changed model, divided by a step.
    Towards { parameters: Parameters, step: f64 },
    /// Values of any bins.
    Column(Box<dyn Fn(Range<usize>) -> Vec<f64> + Sync + 'a>),
}

/// Products of directions at a model.
pub(crate) struct Grams {
    /// Products of the directions and, last, the residual, less what gains, baselines and the model's own parameters fit.
    reduced: DMatrix<f64>,
    /// Each direction's product with itself before that.
    whole: Vec<f64>,
    /// Each block's product of direction and residual after that: direction by direction.
    along: Vec<Vec<f64>>,
    /// Each block's product of the direction with itself.
    squares: Vec<Vec<f64>>,
}

/// A direction during a pass.
enum Running<'a> {
    Towards { stream: Box<Mutex<Stream<'a>>>, per_step: f64 },
    Column(Box<dyn Fn(Range<usize>) -> Vec<f64> + Sync + 'a>),
}

/// The directions' values at the bins of a chunk, and the gains'.
struct Chunk {
    bins: Range<usize>,
    columns: Vec<Vec<f64>>,
    by_gain: Vec<f64>,
}

/// Sums over bins of one segment, with the residual as the last direction.
struct Sums {
    segment: usize,
    /// Products of all directions.
    products: DMatrix<f64>,
    border: Border,
}

/// Products with each element's baseline and gain.
#[derive(Clone)]
struct Border {
    /// Element by element, direction by direction.
    by_baseline: DMatrix<f64>,
    by_gain: DMatrix<f64>,
    /// Of each element: baseline with itself, with gain, and gain with itself.
    own: Vec<[f64; 3]>,
}

/// What is kept of a block, in single precision: parts of a test's statistic.
struct Block {
    number: usize,
    segment: usize,
    /// Products of the model's own directions and the residual with all directions.
    rows: DMatrix<f32>,
    diagonal: Vec<f32>,
    by_baseline: DMatrix<f32>,
    by_gain: DMatrix<f32>,
    own: Vec<[f64; 3]>,
}

/// Sums over all data.
struct Total {
    products: DMatrix<f64>,
    segments: Vec<Border>,
    blocks: Vec<Block>,
}

impl Problem<'_> {
    /// The products of directions at a fitted model.
    pub(crate) fn grams(&self, at: &Fitted, directions: Vec<Direction<'_>>) -> Result<Grams, DiscoverError> {
        let own = self.free(&at.parameters);
        let mut all: Vec<Direction<'_>> =
            own.iter().map(|free| self.towards(&at.parameters, *free)).collect();
        all.extend(directions);
        let mut more = at.parameters.clone();
        more.sensitivity.iter_mut().for_each(|gain| *gain *= 1.0 + GAIN_SHARE);
        all.push(Direction::Towards { parameters: more, step: GAIN_SHARE });
        let segments = Segments::of(self, &at.parameters);
        let total = self.sums(at, all, own.len(), &segments)?;
        let elimination = Elimination::of(self, &total, &segments, &at.parameters);
        Ok(elimination.grams(&total.blocks, own.len()))
    }

    /// Sums over all data. The last direction is that of the gains.
    fn sums(
        &self,
        at: &Fitted,
        directions: Vec<Direction<'_>>,
        own: usize,
        segments: &Segments,
    ) -> Result<Total, DiscoverError> {
        let bins = self.predictor.bins;
        let standing = self.standing(&at.parameters, &at.predicted);
        let joined = bins.blocks.div_ceil(BLOCKS_MAX).max(1);
        let mut total = Total::new(directions.len(), bins.elements, segments.run.len());
        let running: Vec<Running<'_>> =
            directions.into_iter().map(|one| self.running(one)).collect::<Result<_, DiscoverError>>()?;
        for first in (0..bins.len()).step_by(CHUNK_BINS) {
            let range = first..(first + CHUNK_BINS).min(bins.len());
            let column = |direction: &Running<'_>| direction.values(range.clone(), &at.predicted);
            let mut columns: Vec<Vec<f64>> =
                parallel::map(&running, column).into_iter().collect::<Result<_, DiscoverError>>()?;
            let by_gain = columns.pop().unwrap_or_default();
            let chunk = Chunk { bins: range.clone(), columns, by_gain };
            // The chunk's parts of one block and one segment each.
            let key = |bin: usize| (bins.block[bin] / joined, segments.of_bin[bin]);
            let used: Vec<usize> = range.filter(|bin| self.train[*bin] > 0.0).collect();
            let parts: Vec<&[usize]> = used.chunk_by(|one, next| key(*one) == key(*next)).collect();
            let sums = parallel::map(&parts, |part| self.sums_of(&chunk, part, &standing, segments));
            for (part, sums) in parts.iter().zip(&sums) {
                total.add(bins.block[part[0]] / joined, own, sums);
            }
        }
        Ok(total)
    }

    fn running<'a>(&'a self, direction: Direction<'a>) -> Result<Running<'a>, DiscoverError> {
        Ok(match direction {
            Direction::Towards { parameters, step } => Running::Towards {
                stream: Box::new(Mutex::new(self.predictor.stream(parameters)?)),
                // A parameter that cannot move has no derivative.
                per_step: if step == 0.0 { 0.0 } else { 1.0 / step },
            },
            Direction::Column(values) => Running::Column(values),
        })
    }

    /// Sums over the bins of a chunk that belong to one block.
    fn sums_of(&self, chunk: &Chunk, part: &[usize], standing: &[f64], segments: &Segments) -> Sums {
        let elements = self.predictor.bins.elements;
        let count = chunk.columns.len() + 1;
        let weighed: Vec<usize> =
            (0..elements).filter(|element| self.element_weight[*element] > 0.0).collect();
        // Bin, element and the root of the weight.
        let of_bin = |bin: usize| {
            let root = move |element: &usize| (self.train[bin] * self.element_weight[*element]).sqrt();
            weighed.iter().map(move |element| (bin, *element, root(element)))
        };
        let readings: Vec<(usize, usize, f64)> = part.iter().copied().flat_map(of_bin).collect();
        let place = |bin: usize, element: usize| (bin - chunk.bins.start) * elements + element;
        let mut sums = Sums {
            segment: segments.of_bin[part[0]],
            products: DMatrix::zeros(count, count),
            border: Border::new(count, elements),
        };
        let gains: Vec<f64> =
            readings.iter().map(|(bin, element, root)| root * chunk.by_gain[place(*bin, *element)]).collect();
        for ((_, element, root), gain) in readings.iter().zip(&gains) {
            let [one, mixed, square] = &mut sums.border.own[*element];
            *one += root * root;
            *mixed += root * gain;
            *square += gain * gain;
        }
        // Directions that do nothing here, such as those of contact far from it, take no part.
        let mut active: Vec<usize> = Vec::new();
        let mut values: Vec<f64> = Vec::new();
        for number in 0..count {
            let value = |(bin, element, root): &(usize, usize, f64)| match chunk.columns.get(number) {
                Some(column) => root * column[place(*bin, *element)],
                None => root * standing[bin * elements + element],
            };
            let at = values.len();
            values.extend(readings.iter().map(value));
            if values[at..].iter().all(|value| *value == 0.0) {
                values.truncate(at);
                continue;
            }
            active.push(number);
            for ((value, gain), (_, element, root)) in values[at..].iter().zip(&gains).zip(&readings) {
                sums.border.by_baseline[(*element, number)] += value * root;
                sums.border.by_gain[(*element, number)] += value * gain;
            }
        }
        let values = DMatrix::from_vec(readings.len(), active.len(), values);
        let products = values.transpose() * &values;
        for (j, column) in active.iter().enumerate() {
            for (i, row) in active.iter().enumerate() {
                sums.products[(*row, *column)] = products[(i, j)];
            }
        }
        sums
    }
}

/// Step of the derivative by the gains.
const GAIN_SHARE: f64 = 1e-3;

impl Running<'_> {
    /// Its values at the next bins.
    fn values(&self, bins: Range<usize>, predicted: &[f64]) -> Result<Vec<f64>, DiscoverError> {
        let (stream, per_step) = match self {
            Self::Column(values) => return Ok(values(bins)),
            Self::Towards { stream, per_step } => (stream, per_step),
        };
        let mut stream = stream.lock().unwrap_or_else(PoisonError::into_inner);
        let mut column = Vec::new();
        stream.take(bins.len(), &mut column)?;
        let now = predicted.chunks_exact(column.len() / bins.len()).skip(bins.start).flatten();
        column.iter_mut().zip(now).for_each(|(value, now)| *value = (*value - now) * per_step);
        Ok(column)
    }
}

impl Border {
    fn new(count: usize, elements: usize) -> Self {
        let zeros = || DMatrix::zeros(elements, count);
        Self { by_baseline: zeros(), by_gain: zeros(), own: vec![[0.0; 3]; elements] }
    }

    fn add(&mut self, other: &Self) {
        self.by_baseline += &other.by_baseline;
        self.by_gain += &other.by_gain;
        add(&mut self.own, &other.own);
    }
}

fn add(to: &mut [[f64; 3]], of: &[[f64; 3]]) {
    for (to, of) in to.iter_mut().flatten().zip(of.iter().flatten()) {
        *to += of;
    }
}

impl Total {
    fn new(count: usize, elements: usize, segments: usize) -> Self {
        Self {
            products: DMatrix::zeros(count, count),
            segments: vec![Border::new(count, elements); segments],
            blocks: Vec::new(),
        }
    }

    /// Adds the sums over a part of a block; parts come in order of time.
    fn add(&mut self, number: usize, own: usize, sums: &Sums) {
        self.products += &sums.products;
        self.segments[sums.segment].add(&sums.border);
        let part = Block::of(number, own, sums);
        match self.blocks.last_mut().filter(|last| (last.number, last.segment) == (number, sums.segment)) {
            Some(last) => last.add(&part),
            None => self.blocks.push(part),
        }
    }
}

impl Block {
    fn of(number: usize, own: usize, Sums { segment, products, border }: &Sums) -> Self {
        let last = products.nrows() - 1;
        #[expect(clippy::cast_possible_truncation, reason = "parts of a test's statistic")]
        let single = |value: f64| value as f32;
        let rows = DMatrix::from_fn(own + 1, last + 1, |row, number| {
            single(products[(if row < own { row } else { last }, number)])
        });
        Self {
            number,
            segment: *segment,
            rows,
            diagonal: products.diagonal().iter().map(|value| single(*value)).collect(),
            by_baseline: border.by_baseline.map(single),
            by_gain: border.by_gain.map(single),
            own: border.own.clone(),
        }
    }

    fn add(&mut self, other: &Self) {
        self.rows += &other.rows;
        self.diagonal.iter_mut().zip(&other.diagonal).for_each(|(to, of)| *to += of);
        self.by_baseline += &other.by_baseline;
        self.by_gain += &other.by_gain;
        add(&mut self.own, &other.own);
    }
}

/// Stretches of time that have a baseline of their own: runs, or the parts of a walk.
struct Segments {
    of_bin: Vec<usize>,
    run: Vec<usize>,
    /// Precision of the difference between neighbours of one run, in counts^-2; 0 without a walk.
    stiffness: f64,
}

impl Segments {
    fn of(problem: &Problem<'_>, at: &Parameters) -> Self {
        let bins = problem.predictor.bins;
        let walk =
            at.terms.iter().find(|term| is_random_walk(term)).map(|term| [term.values[0], term.values[1]]);
        let walk = walk.filter(|[rate, knot_s]| *rate > 0.0 && *knot_s > 0.0);
        let (mut of_bin, mut run) = (Vec::with_capacity(bins.len()), Vec::new());
        let mut key = None;
        for bin in 0..bins.len() {
            #[expect(clippy::cast_possible_truncation, reason = "a number of segments")]
            let part = walk.map_or(0, |[_, knot_s]| (bins.t_s[bin] / knot_s) as i64);
            // A block has one segment.
            let is_new = key.is_none_or(|(before_run, before)| before_run != bins.run[bin] || before != part);
            let starts = bin == 0 || bins.block[bin] != bins.block[bin - 1];
            if is_new && starts {
                key = Some((bins.run[bin], part));
                run.push(bins.run[bin]);
            }
            of_bin.push(run.len().saturating_sub(1));
        }
        let stiffness = walk.map_or(0.0, |[rate, knot_s]| 1.0 / (rate * rate * knot_s));
        Self { of_bin, run, stiffness }
    }
}

/// What gains and baselines fit of each direction.
struct Elimination {
    /// Coefficients of the baselines in each segment: element by element, direction by direction.
    baselines: Vec<DMatrix<f32>>,
    /// Coefficients of the gains.
    gains: DMatrix<f32>,
    reduced: DMatrix<f64>,
    whole: Vec<f64>,
}

impl Elimination {
    fn of(problem: &Problem<'_>, total: &Total, segments: &Segments, at: &Parameters) -> Self {
        let elements = problem.predictor.bins.elements;
        let mut reduced = total.products.clone();
        let count = reduced.nrows();
        let whole = reduced.diagonal().as_slice().to_vec();
        let stretches = segments.run.len();
        let mut baselines = vec![DMatrix::zeros(elements, count); stretches];
        let mut gains = DMatrix::zeros(elements, count);
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
            let share = if has_gain { &of_gain / gain_square } else { DVector::zeros(count) };
            if has_gain {
                reduced.ger(-1.0 / gain_square, &of_gain, &of_gain, 1.0);
            }
            #[expect(clippy::cast_possible_truncation, reason = "parts of a test's statistic")]
            for number in 0..count {
                gains[(element, number)] = share[number] as f32;
                for (stretch, baselines) in baselines.iter_mut().enumerate() {
                    let with_gain = fitted[(stretch, number)] - fitted[(stretch, count)] * share[number];
                    baselines[(element, number)] = with_gain as f32;
                }
            }
        }
        Self { baselines, gains, reduced, whole }
    }

    /// Eliminates the first `own` directions too, and gives each block's parts.
    fn grams(mut self, blocks: &[Block], own: usize) -> Grams {
        let count = self.reduced.nrows();
        let coefficients = self.sweep(own);
        let last = count - 1;
        let (mut along, mut squares) = (vec![Vec::new(); last - own], vec![Vec::new(); last - own]);
        for block in blocks {
            let (rows, diagonal) = self.of_block(block, own);
            // The products of each direction and the residual, less what the model's own directions fit of the residual,
            let left = |number: usize| {
                rows[(own, number)]
                    - (0..own).map(|one| coefficients[(one, last)] * rows[(one, number)]).sum::<f64>()
            };
            let of_own: Vec<f64> = (0..own).map(left).collect();
            for number in own..last {
                // and less what they fit of the direction.
                let shares = coefficients.view((0, number), (own, 1));
                let taken: f64 = shares.iter().zip(&of_own).map(|(share, of)| share * of).sum();
                along[number - own].push(left(number) - taken);
                let mut square = diagonal[number];
                for (one, share) in shares.iter().enumerate() {
                    let of_others: f64 =
                        shares.iter().enumerate().map(|(other, another)| another * rows[(one, other)]).sum();
                    square += share * (of_others - 2.0 * rows[(one, number)]);
                }
                squares[number - own].push(square.max(0.0));
            }
        }
        let left = count - own;
        let mut reduced = self.reduced.view((own, own), (left, left)).clone_owned();
        for number in 0..left - 1 {
            if reduced[(number, number)] <= OWN_LEAST * self.whole[own + number] {
                reduced.row_mut(number).fill(0.0);
                reduced.column_mut(number).fill(0.0);
            }
        }
        Grams { reduced, whole: self.whole.split_off(own), along, squares }
    }

    /// Eliminates the first `own` directions from the reduced products. Returns their coefficients in every direction.
    fn sweep(&mut self, own: usize) -> DMatrix<f64> {
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
        coefficients
    }

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

impl Grams {
    /// The reduced products: of the directions, and with the residual as the last row and column.
    pub(crate) const fn reduced(&self) -> &DMatrix<f64> {
        &self.reduced
    }

    /// A direction's size before the elimination.
    pub(crate) fn whole(&self, direction: usize) -> f64 {
        self.whole[direction].sqrt()
    }

    /// A direction's size.
    pub(crate) fn size(&self, direction: usize) -> f64 {
        self.reduced[(direction, direction)].max(0.0).sqrt()
    }

    /// Each block's product of a direction and the residual.
    pub(crate) fn along(&self, direction: usize) -> &[f64] {
        &self.along[direction]
    }

    /// Each block's product of a direction with itself.
    pub(crate) fn squares(&self, direction: usize) -> &[f64] {
        &self.squares[direction]
    }
}
