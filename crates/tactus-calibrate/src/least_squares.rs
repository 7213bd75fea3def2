//! Weighted least squares, linear or not, by the damped Gauss-Newton method.
//!
//! # Source
//! Levenberg and Marquardt; the damping's schedule is that of Madsen, Nielsen and Tingleff, *Methods for Non-Linear Least
//! Squares Problems* (2004), Sec. 3.2.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Damping at which the search ends.
const DAMPING_MAX: f64 = 1e10;
const ROUNDS_MAX: usize = 100;
/// The search ends when a step would reduce the cost by less than this share.
const PROMISE_LEAST: f64 = 1e-10;

/// The normal equations of one round, accumulated observation by observation.
#[derive(Debug, Clone)]
pub(crate) struct Normal {
    gram: DMatrix<f64>,
    right: DVector<f64>,
    /// Sum of the squared residuals, weighted.
    pub(crate) cost: f64,
    /// Number of observations.
    pub(crate) readings: usize,
}

impl Normal {
    pub(crate) fn new(parameters: usize) -> Self {
        let (gram, right) = (DMatrix::zeros(parameters, parameters), DVector::zeros(parameters));
        Self { gram, right, cost: 0.0, readings: 0 }
    }

    /// Adds an observation: its residual (measured less predicted), the prediction's derivatives by the parameters that it
    /// depends on, and its weight, one over its variance.
    pub(crate) fn add(&mut self, residual: f64, slopes: &[(usize, f64)], weight: f64) {
        self.cost += weight * residual * residual;
        self.readings += 1;
        for (place, (row, slope)) in slopes.iter().enumerate() {
            let weighted = weight * slope;
            self.right[*row] += weighted * residual;
            for (column, other) in &slopes[..=place] {
                self.gram[(*row.max(column), *row.min(column))] += weighted * other;
            }
        }
    }

    /// Adds an element's observations in one press, which share one reading at rest and its error.
    ///
    /// With `n_j` frames in a reading and `m` at rest, of one noise, the covariance is that of `diag(1/n) + 1/m`; its
    /// inverse is `diag(n) - n n^T / (m + sum n)` (Sherman and Morrison).
    pub(crate) fn add_press(&mut self, readings: &[Observation], rest_frames: usize, noise: f64) {
        let per_frame = 1.0 / (noise * noise);
        let (mut residual, mut frames) = (0.0, 0.0);
        let mut slopes: Vec<(usize, f64)> = Vec::new();
        for reading in readings {
            let count = reading.frames as f64;
            self.add(reading.residual, &reading.slopes, count * per_frame);
            residual += count * reading.residual;
            frames += count;
            slopes.resize(reading.slopes.len(), (0, 0.0));
            for (sum, (parameter, slope)) in slopes.iter_mut().zip(&reading.slopes) {
                *sum = (*parameter, sum.1 + count * slope);
            }
        }
        self.add(residual, &slopes, -per_frame / (rest_frames as f64 + frames));
        self.readings -= 1;
    }

    /// Solves for a step with damped normal equations; parameters that are not free stay.
    fn step(&self, free: &[bool], damping: f64) -> Option<DVector<f64>> {
        let mut gram = self.gram.clone();
        let mut right = self.right.clone();
        for (index, free) in free.iter().enumerate() {
            if *free {
                gram[(index, index)] *= 1.0 + damping;
            } else {
                hold(&mut gram, index);
                right[index] = 0.0;
            }
        }
        Some(scaled(gram)?.solve(&right))
    }

    fn covariance(&self, free: &[bool]) -> Option<DMatrix<f64>> {
        let mut gram = self.gram.clone();
        for (index, _) in free.iter().enumerate().filter(|(_, free)| !**free) {
            hold(&mut gram, index);
        }
        let mut covariance = scaled(gram)?.inverse();
        for (index, _) in free.iter().enumerate().filter(|(_, free)| !**free) {
            covariance[(index, index)] = 0.0;
        }
        Some(covariance)
    }
}

/// The mean over some frames, compared with a prediction.
#[derive(Debug, Clone)]
pub(crate) struct Observation {
    /// Measured less predicted.
    pub(crate) residual: f64,
    /// Derivatives of the prediction by parameters, in the same order in every reading of a press.
    pub(crate) slopes: Vec<(usize, f64)>,
    pub(crate) frames: usize,
}

/// Where the cost is least.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) parameters: Vec<f64>,
    /// Covariance of the parameters if the weights are right; 0 for those that were not free.
    pub(crate) covariance: DMatrix<f64>,
    /// Cost over degrees of freedom: 1 if the weights are right and the model holds.
    pub(crate) misfit: f64,
}

impl Fit {
    /// The factor by which variances grow if residuals exceed the noise; at least 1.
    pub(crate) fn inflation(&self) -> f64 {
        self.misfit.max(1.0)
    }
}

/// Minimises the cost over the free parameters, from a start. `evaluate` gives the normal equations at parameters, or
/// `None` where there is no model.
///
/// `None` if the readings do not determine the free parameters.
pub(crate) fn minimise(
    start: Vec<f64>,
    free: &[bool],
    mut evaluate: impl FnMut(&[f64]) -> Option<Normal>,
) -> Option<Fit> {
    let mut at = DVector::from_vec(start);
    let mut normal = evaluate(at.as_slice())?;
    // Nielsen's schedule: less damping after a step that reduced the cost as predicted, ever more after steps that failed.
    let (mut damping, mut growth) = (1e-6, 2.0);
    for _ in 0..ROUNDS_MAX {
        let step = normal.step(free, damping);
        let promise = step.as_ref().map_or(f64::INFINITY, |step| step.dot(&normal.right));
        if promise <= PROMISE_LEAST * (normal.cost + f64::MIN_POSITIVE) || damping > DAMPING_MAX {
            break;
        }
        let there = step.map(|step| &at + step);
        let next = there.as_ref().and_then(|there| evaluate(there.as_slice()));
        if let Some((there, next)) = there.zip(next).filter(|(_, next)| next.cost < normal.cost) {
            let kept = (normal.cost - next.cost) / promise;
            damping = (damping * (1.0 - (2.0 * kept - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-12);
            growth = 2.0;
            (at, normal) = (there, next);
        } else {
            damping *= growth;
            growth *= 2.0;
        }
    }
    let covariance = normal.covariance(free)?;
    let estimated = free.iter().filter(|free| **free).count();
    let freedom = normal.readings.checked_sub(estimated).filter(|freedom| *freedom > 0)?;
    let misfit = normal.cost / freedom as f64;
    Some(Fit { parameters: at.as_slice().to_vec(), covariance, misfit })
}

/// A Cholesky decomposition with rows and columns scaled to a diagonal of ones.
struct Scaled {
    scale: DVector<f64>,
    cholesky: Cholesky<f64, nalgebra::Dyn>,
}

/// Uses the lower triangle only. `None` if the matrix is singular.
fn scaled(mut gram: DMatrix<f64>) -> Option<Scaled> {
    let scale = gram.diagonal().map(|square| 1.0 / square.sqrt());
    if !scale.iter().all(|value| value.is_finite()) {
        return None;
    }
    for column in 0..gram.ncols() {
        for row in column..gram.nrows() {
            gram[(row, column)] *= scale[row] * scale[column];
        }
    }
    let cholesky = Cholesky::new(gram)?;
    // A pivot of the size of rounding errors: the observations do not determine the parameters.
    let least = cholesky.l_dirty().diagonal().min();
    (least > 1e-7).then_some(Scaled { scale, cholesky })
}

impl Scaled {
    fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        self.cholesky.solve(&right.component_mul(&self.scale)).component_mul(&self.scale)
    }

    fn inverse(&self) -> DMatrix<f64> {
        let mut inverse = self.cholesky.inverse();
        for column in 0..inverse.ncols() {
            for row in 0..inverse.nrows() {
                inverse[(row, column)] *= self.scale[row] * self.scale[column];
            }
        }
        inverse
    }
}

/// Takes a parameter out of the equations.
fn hold(gram: &mut DMatrix<f64>, index: usize) {
    gram.row_mut(index).fill(0.0);
    gram.column_mut(index).fill(0.0);
    gram[(index, index)] = 1.0;
}

#[cfg(test)]
#[path = "least_squares_tests.rs"]
mod tests;
