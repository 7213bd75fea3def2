//! The joint fit: base parameters and effects together, by weighted least squares.
//!
//! ```text
//! counts(row, e) = baseline(run, e) + gain_e m_e(row; sigma, effects) + ...
//! ```
//!
//! Baselines and gains each act on one element, so that they are eliminated in closed form: every residual and every
//! derivative by another parameter is first freed of what an element's own baseline and gain can take up. What remains
//! is a small problem in the spread and the parameters of the effects, solved by damped Gauss-Newton steps.
//!
//! # Source
//! Variable projection: G. H. Golub and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413. Damping: Levenberg and
//! Marquardt.

use nalgebra::{DMatrix, DVector};
use tactus_model::effect::Kind;

use crate::contacts::Contacts;
use crate::noise::{Noise, median};
use crate::scale::Scale;
use crate::sensor::{Parameters, Sensor, Term};
use crate::{DiscoverError, parallel};

/// Recalibration moves an element's gain within these, as ratios to what is typical of the array: an element beyond is
/// not an element of another gain.
const GAIN_RATIOS: [f64; 2] = [0.25, 4.0];
/// So near to an end a gain is at it.
const PIN_MARGIN: f64 = 0.02;
/// An element whose reading tells its gain worse than this share keeps its declared gain.
const GAIN_ERROR_MAX: f64 = 0.3;
/// A fit ends when a step promises to lessen the cost by less than this.
const COST_LEAST: f64 = 0.05;
const COST_SHARE_LEAST: f64 = 1e-4;

/// An effect with more parameters has many.
const PARAMETERS_MANY: usize = 6;

/// How far a model is from the held-out rows beyond their noise, in units of the noise's variance, summed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeldOutGap {
    pub(crate) value: f64,
    /// Its standard error, by whole blocks.
    pub(crate) error: f64,
}

/// What is to be fitted, and how readings weigh.
#[derive(Debug)]
pub(crate) struct Problem<'a> {
    pub(crate) sensor: Sensor<'a>,
    /// Inverse variance of a reading of each element, times that of the row.
    pub(crate) element_weight: Vec<f64>,
    /// Weight of the fitted rows; 0 for those held out.
    pub(crate) train: Vec<f64>,
    /// Coverings in the data: with one the slope of the spread is not free.
    pub(crate) coverings: usize,
    /// True if the spread is free at all.
    pub(crate) spread_free: bool,
    /// Duration of the longest run.
    pub(crate) duration_s: f64,
}

/// A model that was fitted.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) parameters: Parameters,
    pub(crate) predicted: Vec<f64>,
    /// Weighted sum of squared residuals of the fitted rows.
    pub(crate) cost: f64,
    /// Standard errors of the terms' parameters; not a number where one was not free.
    pub(crate) errors: Vec<Vec<f64>>,
}

/// A parameter that is fitted, other than gains and baselines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Free {
    SigmaIntercept,
    SigmaSlope,
    Of { term: usize, parameter: usize },
}

/// Derivatives at a point, freed of gains and baselines.
pub(crate) struct Linear<'a> {
    problem: &'a Problem<'a>,
    /// Of the counts by each element's relative gain, centred in each run.
    by_gain: Vec<f64>,
    /// Its means before it was centred, run by run.
    by_gain_means: Vec<f64>,
    /// Of every element, the weighted sum of squares of that; 0 where the gain is not free.
    by_gain_squares: Vec<f64>,
}

/// The noise is known to so many standard errors.
const SURE_Z: f64 = 2.0;
/// A gap of so many standard errors is known within a few percent.
const LARGE_Z: f64 = 20.0;

impl HeldOutGap {
    /// True if the doubt about the noise is a small part of it.
    pub(crate) fn is_large(self) -> bool {
        self.value > LARGE_Z * self.error
    }

    /// What is left beyond the doubt about the noise.
    pub(crate) fn sure(self) -> f64 {
        (self.value - SURE_Z * self.error).max(0.0)
    }
}

impl<'a> Problem<'a> {
    /// A fit of the rows that are not held out.
    pub(crate) fn new(sensor: Sensor<'a>, noise: &Noise) -> Self {
        let (rows, frames) = (sensor.rows, sensor.frames);
        let weigh = |(weight, heldout): (&f64, &bool)| if *heldout { 0.0 } else { *weight };
        let train = rows.weight.iter().zip(&rows.heldout).map(weigh).collect();
        // A single element that is quieter than most is not told from rounding.
        let element_weight =
            noise.by_element_counts.iter().map(|rms| rms.max(0.7 * noise.rms_counts).powi(-2)).collect();
        let mut coverings_mm = frames.covering_mm.clone();
        coverings_mm.sort_by(f64::total_cmp);
        coverings_mm.dedup();
        Self {
            element_weight,
            train,
            coverings: coverings_mm.len(),
            spread_free: Contacts::of(frames).distinct_places() > 1,
            duration_s: frames.t_s.iter().copied().fold(1.0, f64::max),
            sensor,
        }
    }

    /// What a fit moves, of a model of such terms.
    pub(crate) fn free(&self, parameters: &Parameters) -> Vec<Free> {
        let mut free = Vec::new();
        if self.spread_free {
            free.push(Free::SigmaIntercept);
            if self.coverings > 1 {
                free.push(Free::SigmaSlope);
            }
        }
        for (term, Term { definition, .. }) in parameters.terms.iter().enumerate() {
            for (parameter, known) in definition.parameters.iter().enumerate() {
                if known.kind == Kind::Real && known.name != "duration_s" {
                    free.push(Free::Of { term, parameter });
                }
            }
        }
        free
    }

    pub(crate) fn predict(&self, parameters: &Parameters) -> Result<Vec<f64>, DiscoverError> {
        self.sensor.predict(parameters)
    }

    /// Weighted sum of squared residuals of the fitted rows.
    pub(crate) fn cost(&self, predicted: &[f64]) -> f64 {
        self.residuals(predicted)
            .zip(self.weights())
            .map(|(residual, weight)| weight * residual * residual)
            .sum()
    }

    /// Weighted squared residuals of the rows that are held out, block by block, and the readings in each.
    pub(crate) fn heldout_blocks(&self, predicted: &[f64]) -> Vec<[f64; 2]> {
        let rows = self.sensor.rows;
        let elements = rows.elements;
        let mut blocks = vec![[0.0; 2]; rows.blocks];
        let of_rows = rows.counts.chunks_exact(elements).zip(predicted.chunks_exact(elements)).enumerate();
        for (row, (counts, predicted)) in of_rows.filter(|(row, _)| rows.heldout[*row]) {
            let squares = counts.iter().zip(predicted).zip(&self.element_weight);
            let sum: f64 = squares.map(|((counts, of), weight)| weight * (counts - of).powi(2)).sum();
            let [total, readings] = &mut blocks[rows.block[row]];
            *total += rows.weight[row] * sum;
            *readings += elements as f64;
        }
        blocks
    }

    /// By how much the held-out rows are nearer to one model than to another, and the error of that, by whole blocks.
    pub(crate) fn heldout_gain(&self, less: &Fitted, more: &Fitted) -> [f64; 2] {
        let (less, more) = (self.heldout_blocks(&less.predicted), self.heldout_blocks(&more.predicted));
        let gains: Vec<f64> = less.iter().zip(&more).map(|(less, more)| less[0] - more[0]).collect();
        let sum: f64 = gains.iter().sum();
        let held = less.iter().filter(|[_, readings]| *readings > 0.0).count().max(1) as f64;
        let scatter: f64 = gains.iter().map(|gain| gain * gain).sum::<f64>() - sum * sum / held;
        // A gain in one block only is no less of one: its noise is that of the difference of two predictions.
        let noise = 4.0 * sum.abs();
        [sum, scatter.max(0.0).min(noise).sqrt()]
    }

    /// How much of a column the residual of all rows holds, and the standard error of that, by whole blocks.
    pub(crate) fn share(&self, column: &[f64], predicted: &[f64]) -> Option<[f64; 2]> {
        let rows = self.sensor.rows;
        let mut blocks = vec![[0.0; 2]; rows.blocks];
        for (index, ((value, counts), of)) in column.iter().zip(&rows.counts).zip(predicted).enumerate() {
            if *value != 0.0 {
                let (row, element) = (index / rows.elements, index % rows.elements);
                let weighted = rows.weight[row] * self.element_weight[element] * value;
                let [along, squares] = &mut blocks[rows.block[row]];
                *along += weighted * (counts - of);
                *squares += weighted * value;
            }
        }
        let squares: f64 = blocks.iter().map(|[_, squares]| squares).sum();
        let share = blocks.iter().map(|[along, _]| along).sum::<f64>() / squares;
        let scatter: f64 = blocks.iter().map(|[along, squares]| (along - share * squares).powi(2)).sum();
        (squares > 0.0).then(|| [share, scatter.sqrt() / squares])
    }

    /// Weighted squared residuals of all rows, fitted and held out, block by block.
    pub(crate) fn blocks(&self, predicted: &[f64]) -> Vec<f64> {
        let rows = self.sensor.rows;
        let mut blocks = vec![0.0; rows.blocks];
        let of_rows = rows.counts.chunks_exact(rows.elements).zip(predicted.chunks_exact(rows.elements));
        for (row, (counts, predicted)) in of_rows.enumerate() {
            let squares = counts.iter().zip(predicted).zip(&self.element_weight);
            let sum: f64 = squares.map(|((counts, of), weight)| weight * (counts - of).powi(2)).sum();
            blocks[rows.block[row]] += rows.weight[row] * sum;
        }
        blocks
    }

    /// Root mean square of the residuals of the rows that are held out, each weighed by its frames.
    pub(crate) fn heldout_rms_counts(&self, predicted: &[f64]) -> f64 {
        let rows = self.sensor.rows;
        let elements = rows.elements;
        let (mut sum, mut readings) = (0.0, 0.0);
        let of_rows = rows.counts.chunks_exact(elements).zip(predicted.chunks_exact(elements)).enumerate();
        for (row, (counts, predicted)) in of_rows.filter(|(row, _)| rows.heldout[*row]) {
            let frames = rows.frames_in(row) as f64;
            sum +=
                frames * counts.iter().zip(predicted).map(|(counts, of)| (counts - of).powi(2)).sum::<f64>();
            readings += frames * elements as f64;
        }
        if readings > 0.0 { (sum / readings).sqrt() } else { 0.0 }
    }

    /// How far a model is from the rows that are held out.
    pub(crate) fn heldout_gap(&self, predicted: &[f64]) -> HeldOutGap {
        let blocks = self.heldout_blocks(predicted);
        let value = blocks.iter().map(|[squares, readings]| squares - readings).sum();
        // Of noise alone: what the model misses is no uncertainty.
        let variance: f64 = blocks.iter().map(|[_, readings]| 2.0 * readings).sum();
        HeldOutGap { value, error: variance.sqrt() }
    }

    pub(crate) fn residuals<'b>(&'b self, predicted: &'b [f64]) -> impl Iterator<Item = f64> + 'b {
        self.sensor.rows.counts.iter().zip(predicted).map(|(counts, predicted)| counts - predicted)
    }

    /// Weights of the fitted readings, row by row, element by element.
    pub(crate) fn weights(&self) -> impl Iterator<Item = f64> + '_ {
        self.train.iter().flat_map(|row| self.element_weight.iter().map(move |element| row * element))
    }

    /// Derivative of every reading by a free parameter, and the step with which it was taken.
    pub(crate) fn slope(
        &self,
        at: &Parameters,
        predicted: &[f64],
        free: Free,
    ) -> Result<Vec<f64>, DiscoverError> {
        let (moved, step) = self.moved(at, free);
        if step == 0.0 {
            return Ok(vec![0.0; predicted.len()]);
        }
        let mut slope = self.predict(&moved)?;
        for (slope, predicted) in slope.iter_mut().zip(predicted) {
            *slope = (*slope - predicted) / step;
        }
        Ok(slope)
    }

    /// The parameters a small step further, and the step, in the units in which a fit moves the parameter.
    fn moved(&self, at: &Parameters, free: Free) -> (Parameters, f64) {
        let mut moved = at.clone();
        let step = match free {
            Free::SigmaIntercept => {
                moved.psf.sigma_intercept_mm += 1e-3;
                1e-3
            }
            Free::SigmaSlope => {
                moved.psf.sigma_per_mm += 1e-3;
                1e-3
            }
            Free::Of { term, parameter } => {
                let scale = self.scale(at, term, parameter);
                let value = at.terms[term].values[parameter];
                let at_the_end = scale.distance(value, scale.forward(value, scale.step)) < 0.5 * scale.step;
                let step = if at_the_end { -scale.step } else { scale.step };
                moved.terms[term].values[parameter] = scale.forward(value, step);
                // Towards a bound the step may be cut short.
                scale.distance(value, moved.terms[term].values[parameter])
            }
        };
        (moved, step)
    }

    fn scale(&self, at: &Parameters, term: usize, parameter: usize) -> Scale {
        let known = &at.terms[term].definition.parameters[parameter];
        Scale::of(known, self.duration_s)
    }

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
        let elements = self.sensor.rows.elements;
        let by_gain_means = self.centre(&mut by_gain);
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
        Ok(Linear { problem: self, by_gain, by_gain_means, by_gain_squares })
    }

    /// Elements whose gain has come to the end of what recalibration may give it: there it stays, for an effect to explain.
    fn pinned(&self, at: &Parameters) -> Vec<bool> {
        let declared = &self.sensor.known.response.sensitivity_counts_per_mm;
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

    /// Takes the mean over the fitted rows of each run off each element; returns the means, run by run.
    fn centre(&self, column: &mut [f64]) -> Vec<f64> {
        let rows = self.sensor.rows;
        let elements = rows.elements;
        let runs = rows.paths.len();
        let mut sums = vec![0.0; runs * elements];
        let mut totals = vec![0.0; runs];
        for (row, values) in column.chunks_exact(elements).enumerate() {
            let (run, weight) = (rows.run[row], self.train[row]);
            totals[run] += weight;
            for (sum, value) in sums[run * elements..].iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
        for (sums, total) in sums.chunks_exact_mut(elements).zip(&totals) {
            for sum in sums {
                *sum = if *total > 0.0 { *sum / total } else { 0.0 };
            }
        }
        for (row, values) in column.chunks_exact_mut(elements).enumerate() {
            for (value, mean) in values.iter_mut().zip(&sums[rows.run[row] * elements..]) {
                *value -= mean;
            }
        }
        sums
    }

    /// Derivatives of every reading by each free parameter.
    pub(crate) fn columns(
        &self,
        at: &Parameters,
        predicted: &[f64],
        threads: usize,
    ) -> Result<Vec<Vec<f64>>, DiscoverError> {
        let free = self.free(at);
        parallel::map(&free, threads, |one| self.slope(at, predicted, *one)).into_iter().collect()
    }

    /// The best parameters near a start, in at most so many rounds. Derivatives by the parameters of effects that have
    /// many, such as the knots of a curve, are taken once: the counts are nearly linear in them.
    pub(crate) fn fit_from(
        &self,
        start: Parameters,
        rounds: usize,
        threads: usize,
    ) -> Result<Fitted, DiscoverError> {
        let free = self.free(&start);
        let mut at = start;
        let mut predicted = self.predict(&at)?;
        let mut cost = self.cost(&predicted);
        let mut damping = 1e-3;
        let mut kept: Vec<Option<Vec<f64>>> = vec![None; free.len()];
        let mut covariance = None;
        for _ in 0..rounds {
            let linear = self.linear(&at, &predicted)?;
            let mut residual: Vec<f64> = self.residuals(&predicted).collect();
            let raw = residual.clone();
            linear.project(&mut residual);
            let places: Vec<usize> = (0..free.len()).collect();
            let column = |place: &usize| match &kept[*place] {
                Some(column) => Ok(column.clone()),
                None => self.slope(&at, &predicted, free[*place]),
            };
            let columns: Vec<Vec<f64>> =
                parallel::map(&places, threads, column).into_iter().collect::<Result<_, DiscoverError>>()?;
            for ((kept, column), one) in kept.iter_mut().zip(&columns).zip(&free) {
                if matches!(one, Free::Of { term, .. } if at.terms[*term].values.len() > PARAMETERS_MANY) {
                    kept.get_or_insert_with(|| column.clone());
                }
            }
            let mut projected = columns.clone();
            for column in &mut projected {
                linear.project(column);
            }
            let (gram, right) = normal(self, &projected, &residual);
            covariance = Some(gram.clone());
            let mut improved = false;
            let mut promise = 0.0;
            while damping < 1e8 {
                let step = solve(&gram, &right, damping);
                promise = step.dot(&right);
                let next = self.stepped(&at, &free, &step, &linear, &raw, &columns);
                let next_predicted = self.predict(&next)?;
                let next_cost = self.cost(&next_predicted);
                if next_cost < cost {
                    damping = (damping / 10.0).max(1e-9);
                    promise = cost - next_cost;
                    (at, predicted, cost) = (next, next_predicted, next_cost);
                    improved = true;
                    break;
                }
                if promise < COST_LEAST.max(COST_SHARE_LEAST * cost) && damping > 1e-3 {
                    break;
                }
                damping *= 10.0;
            }
            if !improved || promise < COST_LEAST.max(COST_SHARE_LEAST * cost) {
                break;
            }
        }
        let errors = self.errors(&at, &free, covariance);
        Ok(Fitted { parameters: at, predicted, cost, errors })
    }

    fn stepped(
        &self,
        at: &Parameters,
        free: &[Free],
        step: &DVector<f64>,
        linear: &Linear<'_>,
        residual: &[f64],
        columns: &[Vec<f64>],
    ) -> Parameters {
        let mut next = at.clone();
        let mut taken = Vec::with_capacity(free.len());
        for (one, step) in free.iter().zip(step.iter()) {
            taken.push(match one {
                Free::SigmaIntercept => {
                    let floor = 0.2 * self.sensor.known.psf.sigma_intercept_mm.abs().max(0.1);
                    let old = next.psf.sigma_intercept_mm;
                    next.psf.sigma_intercept_mm = (old + step.clamp(-0.5, 0.5)).max(floor.min(old));
                    next.psf.sigma_intercept_mm - old
                }
                Free::SigmaSlope => {
                    let old = next.psf.sigma_per_mm;
                    next.psf.sigma_per_mm = (old + step.clamp(-0.3, 0.3)).max(0.0_f64.min(old));
                    next.psf.sigma_per_mm - old
                }
                Free::Of { term, parameter } => {
                    let scale = self.scale(at, *term, *parameter);
                    let value = &mut next.terms[*term].values[*parameter];
                    let old = *value;
                    *value = scale.forward(old, scale.bounded(*step));
                    scale.distance(old, *value)
                }
            });
        }
        // What the rest leaves, the elements' own gains and baselines take up.
        let mut left = residual.to_vec();
        for (column, taken) in columns.iter().zip(taken) {
            for (left, slope) in left.iter_mut().zip(column) {
                *left -= taken * slope;
            }
        }
        linear.take_up(&left, &mut next);
        next
    }

    fn errors(&self, at: &Parameters, free: &[Free], gram: Option<DMatrix<f64>>) -> Vec<Vec<f64>> {
        let mut errors: Vec<Vec<f64>> =
            at.terms.iter().map(|term| vec![f64::NAN; term.values.len()]).collect();
        let Some(gram) = gram else { return errors };
        let size = gram.nrows();
        let scaled = scaled(&gram, 1e-9);
        let Some(inverse) = scaled.try_inverse() else { return errors };
        for (index, one) in free.iter().enumerate().take(size) {
            if let Free::Of { term, parameter } = one {
                let diagonal = gram[(index, index)];
                let variance = inverse[(index, index)] / diagonal;
                let scale = self.scale(at, *term, *parameter);
                let value = at.terms[*term].values[*parameter];
                if diagonal > 0.0 && variance > 0.0 {
                    errors[*term][*parameter] = scale.error(value, variance.sqrt());
                }
            }
        }
        errors
    }
}

impl Linear<'_> {
    /// Frees a column, row by row and element by element, of what gains and baselines can take up.
    pub(crate) fn project(&self, column: &mut [f64]) {
        self.problem.centre(column);
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
        let rows = column.chunks_exact(elements).zip(self.by_gain.chunks_exact(elements));
        for ((values, slopes), weight) in rows.zip(&self.problem.train) {
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

    /// Moves gains and baselines so that they take up what is left.
    fn take_up(&self, left: &[f64], parameters: &mut Parameters) {
        let elements = self.by_gain_squares.len();
        let mut centred = left.to_vec();
        let means = self.problem.centre(&mut centred);
        let shares = self.shares(&centred);
        let declared = &self.problem.sensor.known.response.sensitivity_counts_per_mm;
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
        // The mean that is left in each run, less what the gains' change has moved it by.
        let of_runs = means.chunks_exact(elements).zip(self.by_gain_means.chunks_exact(elements));
        for (baseline, (means, by_gain)) in parameters.baseline.iter_mut().zip(of_runs) {
            for (((baseline, mean), by_gain), taken) in
                baseline.iter_mut().zip(means).zip(by_gain).zip(&taken)
            {
                *baseline += mean - taken * by_gain;
            }
        }
    }
}

/// The normal equations of projected columns.
fn normal(problem: &Problem<'_>, columns: &[Vec<f64>], residual: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let count = columns.len();
    let mut gram = DMatrix::zeros(count, count);
    let mut right = DVector::zeros(count);
    for (i, column) in columns.iter().enumerate() {
        let weighted: Vec<f64> = column.iter().zip(problem.weights()).map(|(c, w)| c * w).collect();
        right[i] = dot(&weighted, residual);
        for (j, other) in columns.iter().enumerate().take(i + 1) {
            gram[(i, j)] = dot(&weighted, other);
            gram[(j, i)] = gram[(i, j)];
        }
    }
    (gram, right)
}

pub(crate) fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

/// A step of the damped normal equations.
pub(crate) fn solve(gram: &DMatrix<f64>, right: &DVector<f64>, damping: f64) -> DVector<f64> {
    let scale = DVector::from_fn(gram.nrows(), |i, _| positive_root(gram[(i, i)]));
    let damped = scaled(gram, damping + 1e-9);
    let scaled_right = DVector::from_fn(gram.nrows(), |i, _| right[i] / scale[i]);
    let Some(factors) = damped.cholesky() else { return DVector::zeros(gram.nrows()) };
    let step = factors.solve(&scaled_right);
    DVector::from_fn(gram.nrows(), |i, _| if gram[(i, i)] > 0.0 { step[i] / scale[i] } else { 0.0 })
}

/// A Gram matrix with ones on its diagonal, and the damping upon them.
fn scaled(gram: &DMatrix<f64>, damping: f64) -> DMatrix<f64> {
    let scale: Vec<f64> = (0..gram.nrows()).map(|i| positive_root(gram[(i, i)])).collect();
    DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| {
        if i == j { 1.0 + damping } else { gram[(i, j)] / (scale[i] * scale[j]) }
    })
}

fn positive_root(square: f64) -> f64 {
    if square > 0.0 { square.sqrt() } else { 1.0 }
}
