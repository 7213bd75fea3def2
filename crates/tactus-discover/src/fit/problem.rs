//! The joint fit: base parameters and effects together, by weighted least squares.
//!
//! ```text
//! counts(bin, e) = baseline(run, e) + g_run gain_e m_e(bin; sigma, effects) + ...
//! ```
//!
//! Several runs of one rig have the effects, the spread and the ratios of the gains in common. Between runs a covering is laid anew and a
//! supply changes, so that all elements together may be more or less sensitive: each run but the first has a factor `g_run`.
//!
//! A baseline and a gain each act on one element, so they are eliminated in closed form: every residual and every
//! derivative by another parameter is first projected onto the complement of the element's own baseline and gain. What
//! remains is a small problem in the spread and the parameters of the effects, solved by damped Gauss-Newton steps.
//!
//! # Source
//! Variable projection: G. H. Golub and V. Pereyra, *SIAM J. Numer. Anal.* 10 (1973) 413. Damping: Levenberg and
//! Marquardt.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use tactus_model::effect::{Parameter, ParameterKind};

use super::elimination::Elimination;
use super::knots::bounded;
use super::parameters::{Parameters, Term};
use super::predictor::Predictor;
use super::scale::{Extent, Scale};
use super::sums::Direction;
use crate::data::{Bins, Contacts, DiscoverError, Noise, QUIETEST};
use crate::numbers::parallel;

/// A fit ends when the expected reduction of the cost by a step is less than this.
const COST_LEAST: f64 = 0.05;
const COST_SHARE_LEAST: f64 = 1e-4;

/// Gains and baselines are fitted first if they alone remove this share of the cost.
const TAKEN_UP_LEAST: f64 = 0.1;

/// A knot is undetermined if the data determine it by less than this share of the knot before.
const UNSEEN_SHARE: f64 = 0.1;

/// A number of frames long beside the correlation time of the noise.
const LONG_FRAMES: usize = 1000;

/// A least-squares problem: the data with their weights, and the model.
#[derive(Debug, Clone)]
pub(crate) struct Problem<'a> {
    pub(crate) predictor: Predictor<'a>,
    /// Inverse variance of a reading of each element, times that of the bin.
    pub(crate) element_weight: Vec<f64>,
    /// Weight of the fitted bins; 0 for those held out.
    pub(crate) train: Vec<f64>,
    /// The same for signals that are slow beside the correlation time of the noise.
    pub(crate) slow: Vec<f64>,
    /// `slow` without contact, where a missing effect of the presses cannot be mistaken for drift; 0 in contact.
    pub(crate) slow_and_clear: Vec<f64>,
    /// Variance of slow sums of the noise, in units of that of the fitted bins' weights.
    pub(crate) variance: f64,
    /// Number of coverings in the data. With one, the slope of the spread is not fitted.
    pub(crate) coverings: usize,
    /// The runs whose factor of all gains is fitted: those with a fitted press, but one.
    pub(crate) gained_runs: Vec<usize>,
    /// True if the spread is fitted.
    pub(crate) spread_free: bool,
    /// How far the data reach.
    pub(crate) extent: Extent,
    /// By how much the variance of a sum of squares exceeds that of independent readings.
    pub(crate) squares_inflation: f64,
}

/// A model that was fitted.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) parameters: Parameters,
    pub(crate) predicted: Vec<f64>,
    /// Weighted sum of squared residuals of the fitted bins; with a random walk, that of constant baselines less the gain in
    /// likelihood.
    pub(crate) cost: f64,
    /// Standard errors of the terms' parameters; NaN where one was not fitted.
    pub(crate) errors: Vec<Vec<f64>>,
}

/// A parameter that is fitted, other than gains and baselines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Free {
    SigmaIntercept,
    SigmaSlope,
    /// The logarithm of the factor of all gains in a run.
    RunGain {
        run: usize,
    },
    Of {
        term: usize,
        parameter: usize,
    },
    /// A knot of a term's free curve, or a place of its tables.
    Knot {
        term: usize,
        knot: usize,
    },
}

/// For each free parameter, its derivative if it is a knot of a curve.
type Knots = Vec<Option<Arc<Stretch>>>;

/// A derivative that is 0 outside a stretch of bins.
#[derive(Debug)]
struct Stretch {
    elements: usize,
    /// The first bin.
    first: usize,
    values: Vec<f32>,
}

impl Stretch {
    fn of(column: &[f64], elements: usize) -> Self {
        let acts = |value: &f64| *value != 0.0;
        let first = column.iter().position(acts).unwrap_or(0) / elements;
        let end = column.iter().rposition(acts).map_or(first, |last| last / elements + 1);
        #[expect(clippy::cast_possible_truncation, reason = "a derivative for steps of a fit")]
        let values = column[first * elements..end * elements].iter().map(|value| *value as f32).collect();
        Self { elements, first, values }
    }

    fn direction(self: Arc<Self>) -> Direction<'static> {
        Direction::Column(Box::new(move |bins: Range<usize>| {
            let value = |place: usize| {
                let place = place.checked_sub(self.first * self.elements);
                place.and_then(|place| self.values.get(place)).map_or(0.0, |value| f64::from(*value))
            };
            (bins.start * self.elements..bins.end * self.elements).map(value).collect()
        }))
    }
}

impl<'a> Problem<'a> {
    /// The problem of fitting the bins that are not held out.
    pub(crate) fn new(predictor: Predictor<'a>, noise: &Noise) -> Self {
        let (bins, frames) = (predictor.bins, predictor.frames);
        let weigh = |(weight, heldout): (&f64, &bool)| if *heldout { 0.0 } else { *weight };
        let train: Vec<f64> = bins.weight.iter().zip(&bins.heldout).map(weigh).collect();
        let inflation = noise.inflation(LONG_FRAMES);
        let slow = |(bin, weight): (usize, &f64)| {
            if *weight > 0.0 { bins.frames_in(bin) as f64 / inflation } else { 0.0 }
        };
        let slow: Vec<f64> = train.iter().enumerate().map(slow).collect();
        let clear = |(bin, weight): (usize, &f64)| if bins.is_clear(frames, bin) { *weight } else { 0.0 };
        let slow_and_clear = slow.iter().enumerate().map(clear).collect();
        let sum = |weights: &[f64]| weights.iter().sum::<f64>();
        let variance = (sum(&train) / sum(&slow).max(f64::MIN_POSITIVE)).max(1.0);
        let least_counts = QUIETEST * noise.rms_counts;
        let element_weight =
            noise.by_element_counts.iter().map(|rms| rms.max(least_counts).powi(-2)).collect();
        let presses = |bin: &usize| train[*bin] > 0.0 && frames.position_mm[bins.first[*bin]][2] < 0.0;
        let mut gained_runs: Vec<usize> = (0..bins.len()).filter(presses).map(|bin| bins.run[bin]).collect();
        gained_runs.dedup();
        let gained_runs = gained_runs.split_off(gained_runs.len().min(1));
        let mut coverings_mm = frames.covering_mm.clone();
        coverings_mm.sort_by(f64::total_cmp);
        coverings_mm.dedup();
        Self {
            element_weight,
            train,
            slow,
            slow_and_clear,
            variance,
            coverings: coverings_mm.len(),
            gained_runs,
            spread_free: Contacts::of(frames).distinct_places() > 1,
            extent: Extent {
                duration_s: frames.t_s.iter().copied().fold(1.0, f64::max),
                span_counts: span_counts(bins, noise),
            },
            predictor,
            squares_inflation: noise.squares_inflation(LONG_FRAMES),
        }
    }

    /// The same of some elements alone.
    pub(super) fn of_elements(&self, is_in: impl Fn(usize) -> bool) -> Self {
        let of = |(element, weight): (usize, &f64)| if is_in(element) { *weight } else { 0.0 };
        Self { element_weight: self.element_weight.iter().enumerate().map(of).collect(), ..self.clone() }
    }

    /// The parameters that a fit of a model varies.
    pub(crate) fn free(&self, parameters: &Parameters) -> Vec<Free> {
        let mut free = Vec::new();
        if self.spread_free {
            free.push(Free::SigmaIntercept);
            if self.coverings > 1 {
                free.push(Free::SigmaSlope);
            }
        }
        free.extend(self.gained_runs.iter().map(|run| Free::RunGain { run: *run }));
        for (term, at) in parameters.terms.iter().enumerate() {
            let Term { definition, values, .. } = at;
            if at.rewires().is_some_and(|element| self.element_weight[element] == 0.0) {
                // Nothing shows the shares of an element without weight.
                continue;
            }
            let mut values = definition.parameters.iter().zip(values);
            if values.any(|(known, value)| known.kind == ParameterKind::ElementOrAll && *value >= 0.0) {
                // The known drift of one element's baseline is not refitted.
                continue;
            }
            for (parameter, known) in definition.parameters.iter().enumerate() {
                if known.name != "duration_s" && at.varies(parameter) {
                    free.push(Free::Of { term, parameter });
                }
            }
            free.extend((0..at.listed()).map(|knot| Free::Knot { term, knot }));
        }
        free
    }

    pub(crate) fn predict(&self, parameters: &Parameters) -> Result<Vec<f64>, DiscoverError> {
        self.predictor.predict(parameters)
    }

    /// Weighted sum of squared residuals of the fitted bins.
    pub(crate) fn cost(&self, predicted: &[f64]) -> f64 {
        self.residuals(predicted)
            .zip(self.weights())
            .map(|(residual, weight)| weight * residual * residual)
            .sum()
    }

    pub(crate) fn residuals<'b>(&'b self, predicted: &'b [f64]) -> impl Iterator<Item = f64> + 'b {
        self.predictor.bins.counts.iter().zip(predicted).map(|(counts, predicted)| counts - predicted)
    }

    /// Number of fitted readings; at least 1.
    pub(crate) fn readings(&self) -> f64 {
        self.weights().filter(|weight| *weight > 0.0).count().max(1) as f64
    }

    /// Weights of the fitted readings, bin by bin, element by element.
    pub(crate) fn weights(&self) -> impl Iterator<Item = f64> + '_ {
        self.train.iter().flat_map(|bin| self.element_weight.iter().map(move |element| bin * element))
    }

    /// Derivative of every reading by a free parameter, by a finite difference.
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

    /// The direction of a free parameter.
    pub(crate) fn towards(&self, at: &Parameters, free: Free) -> Direction<'static> {
        if let Free::RunGain { run } = free {
            return Direction::RunGain(run);
        }
        let (parameters, step) = self.moved(at, free);
        Direction::Towards { parameters, step, factor: None }
    }

    /// The parameters after a small step for a derivative, and that step on the parameter's [`Scale`].
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
            Free::RunGain { run } => {
                moved.run_gain[run] *= 1.0 + 1e-3;
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
            Free::Knot { term, knot } => {
                let step = at.terms[term].small_step(knot);
                moved.terms[term].move_knot(knot, step)
            }
        };
        (moved, step)
    }

    fn scale(&self, at: &Parameters, term: usize, parameter: usize) -> Scale {
        self.scale_of(&at.terms[term].definition.parameters[parameter])
    }

    /// The scale on which a parameter is fitted to these data.
    pub(crate) fn scale_of(&self, parameter: &Parameter) -> Scale {
        Scale::of(parameter, self.extent)
    }

    /// The best parameters near a start, in at most `rounds` rounds. Derivatives by numbered parameters, the knots of a curve, are taken
    /// once, because the counts are nearly linear in them.
    pub(crate) fn fit_from(&self, start: Parameters, rounds: usize) -> Result<Fitted, DiscoverError> {
        let free = self.free(&start);
        let mut at = self.with_walk(start)?;
        let mut predicted = self.predict(&at)?;
        let knots = self.knots(&at, &predicted, &free)?;
        let mut normal = self.normal(&at, &predicted, &free, &knots)?;
        if let Some((better, of_better)) = self.taken_up(&normal, &at, &predicted)? {
            normal = self.normal(&better, &of_better, &free, &knots)?;
            (at, predicted) = (better, of_better);
        }
        let mut cost = self.cost(&predicted);
        let mut damping = 1e-3;
        let mut covariance = None;
        for round in 0..rounds {
            if round > 0 {
                normal = self.normal(&at, &predicted, &free, &knots)?;
            }
            let (gram, right, squares) = normal.equations();
            let least: Vec<f64> = free.iter().map(|one| least_step(&at, *one)).collect();
            let mut improved = false;
            let mut promise = 0.0;
            while damping < 1e8 {
                let step = bounded(&gram, &right, damping, &squares, &least);
                promise = step.dot(&right);
                let (next, of_next) = self.settled(self.stepped(&at, &free, &step, &normal))?;
                let next_cost = self.cost(&of_next);
                if next_cost < cost {
                    damping = (damping / 10.0).max(1e-9);
                    promise = cost - next_cost;
                    (at, predicted, cost) = (next, of_next, next_cost);
                    improved = true;
                    break;
                }
                if promise < undone(cost) && damping > 1e-3 {
                    break;
                }
                damping *= 10.0;
            }
            covariance = Some(gram);
            if !improved || promise < undone(cost) {
                break;
            }
        }
        if covariance.as_ref().is_some_and(|gram| follow(&mut at, &free, gram)) {
            predicted = self.predict(&at)?;
        }
        self.centre_weightless(&mut at, &mut predicted);
        if at.walk.is_some() {
            cost = self.cost_with_walk(&at, &predicted);
        }
        let errors = self.errors(&at, &free, covariance);
        Ok(Fitted { parameters: at, predicted, cost, errors })
    }

    /// The derivatives by the knots among the free parameters.
    fn knots(&self, at: &Parameters, predicted: &[f64], free: &[Free]) -> Result<Knots, DiscoverError> {
        let elements = self.predictor.bins.elements;
        let knot = |one: &Free| match one {
            Free::Of { term, parameter } if at.terms[*term].is_numbered(*parameter) => {
                let slope = self.slope(at, predicted, *one)?;
                Ok(Some(Arc::new(Stretch::of(&slope, elements))))
            }
            Free::SigmaIntercept
            | Free::SigmaSlope
            | Free::RunGain { .. }
            | Free::Of { .. }
            | Free::Knot { .. } => Ok(None),
        };
        parallel::map(free, knot).into_iter().collect()
    }

    /// What gains and baselines fit of the free parameters' directions and of the residual, and what is left.
    fn normal(
        &self,
        at: &Parameters,
        predicted: &[f64],
        free: &[Free],
        knots: &Knots,
    ) -> Result<Elimination, DiscoverError> {
        let direction = |(number, (one, knot)): (usize, (&Free, &Option<Arc<Stretch>>))| match knot {
            Some(knot) => Arc::clone(knot).direction(),
            None => self.of_table(at, *one, number).unwrap_or_else(|| self.towards(at, *one)),
        };
        self.eliminated(at, predicted, free.iter().zip(knots).enumerate().map(direction).collect())
    }

    /// The direction of a place of a table, the `number`-th of a fit: that of all its places together, times the weight of this one. So
    /// a table costs one prediction. Where the covering remembers, this is an approximation, as the directions of a pass are. `None` if the
    /// parameter is of no table.
    pub(super) fn of_table(&self, at: &Parameters, free: Free, number: usize) -> Option<Direction<'static>> {
        let Free::Knot { term, knot } = free else { return None };
        let (table, place) = at.terms[term].table_at(knot)?;
        let (moved, step) = at.terms[term].with_table_moved(table)?;
        let factor = Arc::new(self.weights_at(&at.terms[term].tables[table].1).swap_remove(place));
        if place > 0 {
            return Some(Direction::Times { direction: number - place, factor });
        }
        let mut parameters = at.clone();
        parameters.terms[term] = moved;
        Some(Direction::Towards { parameters, step, factor: Some(factor) })
    }

    /// The parameters with refitted gains and baselines, and their prediction, if this reduces the cost by much. A start whose
    /// effects are not neutral needs it, because its gains are those of a model without these effects.
    fn taken_up(
        &self,
        normal: &Elimination,
        at: &Parameters,
        predicted: &[f64],
    ) -> Result<Option<(Parameters, Vec<f64>)>, DiscoverError> {
        let [before, after] = normal.residual_squares();
        if after > (1.0 - TAKEN_UP_LEAST) * before {
            return Ok(None);
        }
        let mut next = at.clone();
        self.take_up(normal, &[], &mut next);
        let (next, of_next) = self.settled(next)?;
        Ok((self.cost(&of_next) < self.cost(predicted)).then_some((next, of_next)))
    }

    fn stepped(
        &self,
        at: &Parameters,
        free: &[Free],
        step: &DVector<f64>,
        normal: &Elimination,
    ) -> Parameters {
        let mut next = at.clone();
        let mut taken = Vec::with_capacity(free.len());
        for (one, step) in free.iter().zip(step.iter()) {
            taken.push(match one {
                Free::SigmaIntercept => {
                    let floor = 0.2 * self.predictor.known.psf.sigma_intercept_mm.abs().max(0.1);
                    let old = next.psf.sigma_intercept_mm;
                    next.psf.sigma_intercept_mm = (old + step.clamp(-0.5, 0.5)).max(floor.min(old));
                    next.psf.sigma_intercept_mm - old
                }
                Free::SigmaSlope => {
                    let old = next.psf.sigma_per_mm;
                    next.psf.sigma_per_mm = (old + step.clamp(-0.3, 0.3)).max(0.0_f64.min(old));
                    next.psf.sigma_per_mm - old
                }
                Free::RunGain { run } => {
                    let old = next.run_gain[*run];
                    next.run_gain[*run] = old * (1.0 + step.clamp(-0.5, 1.0));
                    next.run_gain[*run] / old - 1.0
                }
                Free::Of { term, parameter } => {
                    let scale = self.scale(at, *term, *parameter);
                    let value = &mut next.terms[*term].values[*parameter];
                    let old = *value;
                    *value = scale.forward(old, scale.bounded(*step));
                    scale.distance(old, *value)
                }
                Free::Knot { term, knot } => next.terms[*term].move_knot(*knot, *step),
            });
        }
        // The elements' own gains and baselines fit what the other parameters leave.
        self.take_up(normal, &taken, &mut next);
        next
    }

    fn errors(&self, at: &Parameters, free: &[Free], gram: Option<DMatrix<f64>>) -> Vec<Vec<f64>> {
        let numbers = |term: &Term| term.values.len() + term.listed();
        let mut errors: Vec<Vec<f64>> = at.terms.iter().map(|term| vec![f64::NAN; numbers(term)]).collect();
        let Some(gram) = gram else { return errors };
        let size = gram.nrows();
        let scaled = scaled(&gram, 1e-9);
        let Some(inverse) = scaled.try_inverse() else { return errors };
        for (index, one) in free.iter().enumerate().take(size) {
            if let Free::Knot { term, knot } = one {
                let of = &at.terms[*term];
                // A value that is a sum of increments has the variance of the sum.
                let first = index - knot;
                let weight = |i: usize| of.moves_with(*knot, i - first) / positive_root(gram[(i, i)]);
                let covariance = |(i, j)| weight(i) * weight(j) * inverse[(i, j)];
                let seen = || (first..=index).filter(|i| gram[(*i, *i)] > 0.0);
                let pairs = seen().flat_map(|i| seen().map(move |j| (i, j)));
                let variance: f64 = pairs.map(covariance).sum();
                if gram[(index, index)] > 0.0 && variance > 0.0 {
                    errors[*term][of.values.len() + knot] = variance.sqrt();
                }
            }
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

/// From the least to the greatest count of the element that varies most; at least the noise.
fn span_counts(bins: &Bins, noise: &Noise) -> f64 {
    let of_element = |element: usize| {
        let counts = || bins.counts.iter().skip(element).step_by(bins.elements).copied();
        counts().fold(f64::NEG_INFINITY, f64::max) - counts().fold(f64::INFINITY, f64::min)
    };
    let seen = noise.by_element_counts.iter().enumerate().filter(|(_, rms)| rms.is_finite());
    seen.map(|(element, _)| of_element(element)).fold(noise.rms_counts.max(f64::MIN_POSITIVE), f64::max)
}

/// The least step of a free parameter that its class allows.
pub(super) fn least_step(at: &Parameters, free: Free) -> f64 {
    match free {
        Free::Knot { term, knot } => at.terms[term].least_step(knot),
        Free::SigmaIntercept | Free::SigmaSlope | Free::RunGain { .. } | Free::Of { .. } => f64::NEG_INFINITY,
    }
}

/// By how much a fit that ended may still be above the least cost.
pub(crate) fn undone(cost: f64) -> f64 {
    COST_LEAST.max(COST_SHARE_LEAST * cost)
}

/// Sets undetermined knots of a curve to the value of the knot before, so that the curve stays constant without data.
/// Returns true if there are such knots.
fn follow(at: &mut Parameters, free: &[Free], gram: &DMatrix<f64>) -> bool {
    let mut any = false;
    for (index, pair) in free.windows(2).enumerate() {
        let [Free::Of { term, parameter: before }, Free::Of { term: same, parameter: knot }] = pair else {
            continue;
        };
        let of = &mut at.terms[*term];
        let unseen = gram[(index + 1, index + 1)] < UNSEEN_SHARE * gram[(index, index)];
        if term == same && of.family(*before) == of.family(*knot) && unseen {
            of.values[*knot] = of.values[*before];
            any = true;
        }
    }
    any
}

/// A step of the damped normal equations. The damping of each parameter is relative to its entry in `squares`.
pub(crate) fn solve(
    gram: &DMatrix<f64>,
    right: &DVector<f64>,
    damping: f64,
    squares: &[f64],
) -> DVector<f64> {
    let scale: Vec<f64> = squares.iter().map(|square| positive_root(*square)).collect();
    let mut damped =
        DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] / (scale[i] * scale[j]));
    for i in 0..gram.nrows() {
        damped[(i, i)] += if gram[(i, i)] > 0.0 { damping + 1e-9 } else { 1.0 };
    }
    let scaled_right = DVector::from_fn(gram.nrows(), |i, _| right[i] / scale[i]);
    let Some(factors) = damped.cholesky() else { return DVector::zeros(gram.nrows()) };
    let step = factors.solve(&scaled_right);
    DVector::from_fn(gram.nrows(), |i, _| if gram[(i, i)] > 0.0 { step[i] / scale[i] } else { 0.0 })
}

/// A Gram matrix scaled to `1 + more` on its diagonal.
fn scaled(gram: &DMatrix<f64>, more: f64) -> DMatrix<f64> {
    let scale: Vec<f64> = (0..gram.nrows()).map(|i| positive_root(gram[(i, i)])).collect();
    DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| {
        if i == j { 1.0 + more } else { gram[(i, j)] / (scale[i] * scale[j]) }
    })
}

fn positive_root(square: f64) -> f64 {
    if square > 0.0 { square.sqrt() } else { 1.0 }
}
