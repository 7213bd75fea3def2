//! Polynomials by least squares, with standard errors.
//!
//! `y = c0 + c1 x + c2 x^2 + ...` is fitted to points of equal weight by minimising the sum of squared residuals.
//! The design matrix, its columns scaled to the largest `|x|`, is made orthogonal (modified Gram-Schmidt), so that
//! no normal equations are formed. With `n` points and `p` coefficients the residual variance is
//! `s^2 = sum r^2 / (n - p)`, and the covariance of the coefficients is `s^2 (X^T X)^-1`.
//!
//! Against the certified values of NIST's data sets Norris and Pontius, coefficients and standard errors are right
//! to better than 1e-9 of their value.
//!
//! # Source
//! Bjorck, *Numerical Methods for Least Squares Problems* (1996), sections 1.4 and 2.4.

/// A fitted polynomial.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    /// Coefficient of `x^k` at index `k`.
    pub coefficients: Vec<Estimate>,
    /// Root of the mean squared residual over the degrees of freedom, in the unit of y; `None` without any.
    pub residual: Option<f64>,
    /// Number of points less the number of coefficients.
    pub degrees_of_freedom: usize,
}

/// An estimated number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Its value.
    pub value: f64,
    /// Its standard error; `None` if there are no more points than coefficients.
    pub standard_error: Option<f64>,
}

/// A column whose part orthogonal to those before it is shorter than this share of it depends on them.
const RANK_TOLERANCE: f64 = 1e-10;

impl Polynomial {
    /// Fits a polynomial of the given degree to points `[x, y]`; points that are not finite are left out.
    ///
    /// `None` if fewer distinct x remain than there are coefficients.
    pub fn fit(degree: usize, points: &[[f64; 2]]) -> Option<Self> {
        let points: Vec<[f64; 2]> =
            points.iter().copied().filter(|point| point.iter().all(|v| v.is_finite())).collect();
        let scale = points.iter().map(|[x, _]| x.abs()).fold(0.0, f64::max);
        let scale = if scale > 0.0 { scale } else { 1.0 };
        let mut solver = Solver::new(points.iter().map(|[_, y]| *y).collect());
        let mut powers = vec![1.0; points.len()];
        for _ in 0..=degree {
            solver.add_column(&powers)?;
            for (power, [x, _]) in powers.iter_mut().zip(&points) {
                *power *= x / scale;
            }
        }
        let degrees_of_freedom = points.len().checked_sub(degree + 1)?;
        let variance = (degrees_of_freedom > 0)
            .then(|| solver.residuals.iter().map(|r| r * r).sum::<f64>() / degrees_of_freedom as f64);
        let mut unit = 1.0;
        let mut coefficients = Vec::with_capacity(degree + 1);
        for (value, spread) in solver.solution() {
            let standard_error = variance.map(|variance| variance.sqrt() * spread / unit);
            coefficients.push(Estimate { value: value / unit, standard_error });
            unit *= scale;
        }
        Some(Self { coefficients, residual: variance.map(f64::sqrt), degrees_of_freedom })
    }

    /// The polynomial's value.
    pub fn at(&self, x: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient.value)
    }
}

/// `X = Q R` column by column, the right-hand side made orthogonal along with it.
struct Solver {
    /// Orthonormal columns.
    q: Vec<Vec<f64>>,
    /// `r[j][i]` for `i <= j`: columns of the upper triangle.
    r: Vec<Vec<f64>>,
    /// `Q^T y`.
    projected: Vec<f64>,
    /// What is left of y.
    residuals: Vec<f64>,
}

impl Solver {
    fn new(y: Vec<f64>) -> Self {
        Self { q: Vec::new(), r: Vec::new(), projected: Vec::new(), residuals: y }
    }

    fn add_column(&mut self, column: &[f64]) -> Option<()> {
        let full = norm(column);
        let mut rest = column.to_vec();
        let mut above = vec![0.0; self.q.len()];
        // The second round takes away what rounding left of the earlier directions in the first.
        for _ in 0..2 {
            for (part, q) in above.iter_mut().zip(&self.q) {
                *part += take_away(&mut rest, q);
            }
        }
        let length = norm(&rest);
        if length.is_nan() || length <= RANK_TOLERANCE * full {
            return None;
        }
        for value in &mut rest {
            *value /= length;
        }
        above.push(length);
        let mut projected = 0.0;
        for _ in 0..2 {
            projected += take_away(&mut self.residuals, &rest);
        }
        self.projected.push(projected);
        self.r.push(above);
        self.q.push(rest);
        Some(())
    }

    /// Each coefficient with the root of its diagonal element of `(X^T X)^-1 = R^-1 R^-T`.
    fn solution(&self) -> Vec<(f64, f64)> {
        let inverse: Vec<Vec<f64>> = (0..self.r.len()).map(|column| self.inverse_column(column)).collect();
        let row = |k: usize| inverse.iter().map(move |column| column.get(k).copied().unwrap_or(0.0));
        (0..self.r.len())
            .map(|k| {
                let value = row(k).zip(&self.projected).map(|(a, b)| a * b).sum();
                (value, row(k).map(|a| a * a).sum::<f64>().sqrt())
            })
            .collect()
    }

    /// Column of the inverse of R, by back substitution; zero below the diagonal.
    fn inverse_column(&self, column: usize) -> Vec<f64> {
        let mut rest = vec![0.0; column + 1];
        rest[column] = 1.0;
        for k in (0..=column).rev() {
            rest[k] /= self.r[k][k];
            let (above, at) = rest.split_at_mut(k);
            for (value, r) in above.iter_mut().zip(&self.r[k]) {
                *value -= r * at[0];
            }
        }
        rest
    }
}

/// Takes the part along the unit vector `q` away from `vector`; returns its length.
fn take_away(vector: &mut [f64], q: &[f64]) -> f64 {
    let along: f64 = vector.iter().zip(q).map(|(a, b)| a * b).sum();
    vector.iter_mut().zip(q).for_each(|(value, q)| *value -= along * q);
    along
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|value| value * value).sum::<f64>().sqrt()
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;
