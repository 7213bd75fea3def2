//! Polynomials by least squares, with standard errors.
//!
//! `y = c0 + c1 x + c2 x^2 + ...` is fitted to points of equal weight by minimising the sum of squared residuals.
//! The design matrix `X`, with x scaled by the largest `|x|`, is decomposed into `Q R` by Householder reflections, so
//! that no normal equations are formed. With `n` points and `p` coefficients the residual variance is
//! `s^2 = sum r^2 / (n - p)`, and the covariance of the coefficients is `s^2 (X^T X)^-1 = s^2 R^-1 R^-T`.
//!
//! Coefficients and standard errors agree with the certified values of NIST's data sets Norris and Pontius to 1e-9 of
//! their value.
//!
//! # Source
//! Bjorck, *Numerical Methods for Least Squares Problems* (1996), sections 1.4 and 2.4.

use nalgebra::{DMatrix, DVector};

/// A fitted polynomial.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    /// Coefficient of `x^k` at index `k`.
    pub coefficients: Vec<Coefficient>,
    /// Residual standard deviation `s`, in the unit of y; `None` without degrees of freedom.
    pub residual: Option<f64>,
    /// Number of points less the number of coefficients.
    pub degrees_of_freedom: usize,
}

/// A coefficient of a [`Polynomial`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficient {
    /// In the unit of y over that of `x^k`.
    pub value: f64,
    /// In the same unit; `None` if there are no more points than coefficients.
    pub standard_error: Option<f64>,
}

/// A column of the design matrix is linearly dependent on those before it if its part orthogonal to them is shorter
/// than this share of its length.
const RANK_TOLERANCE: f64 = 1e-10;

impl Polynomial {
    /// Fits a polynomial of the given degree to points `[x, y]`; points that are not finite are left out.
    ///
    /// `None` if fewer distinct x remain than there are coefficients.
    pub fn fit(degree: usize, points: &[[f64; 2]]) -> Option<Self> {
        let points: Vec<[f64; 2]> =
            points.iter().copied().filter(|point| point.iter().all(|v| v.is_finite())).collect();
        let degrees_of_freedom = points.len().checked_sub(degree + 1)?;
        let scale = points.iter().map(|[x, _]| x.abs()).fold(0.0, f64::max);
        let scale = if scale > 0.0 { scale } else { 1.0 };

        let powers = |[x, _]: &[f64; 2]| {
            let x = x / scale;
            std::iter::successors(Some(1.0), move |power| Some(power * x)).take(degree + 1)
        };
        let design = DMatrix::from_row_iterator(points.len(), degree + 1, points.iter().flat_map(powers));
        let y = DVector::from_iterator(points.len(), points.iter().map(|[_, y]| *y));

        let (q, r) = design.clone().qr().unpack();
        let orthogonal = r.diagonal().map(f64::abs);
        let dependent = |(length, column): (&f64, f64)| *length <= RANK_TOLERANCE * column;
        if orthogonal.iter().zip(design.column_iter().map(|column| column.norm())).any(dependent) {
            return None;
        }
        let scaled = r.solve_upper_triangular(&q.tr_mul(&y))?;
        let inverse = r.solve_upper_triangular(&DMatrix::identity(degree + 1, degree + 1))?;

        let squares = (y - design * &scaled).norm_squared();
        let residual = (degrees_of_freedom > 0).then(|| (squares / degrees_of_freedom as f64).sqrt());
        let mut unit = 1.0;
        let mut coefficients = Vec::with_capacity(degree + 1);
        for (value, row) in scaled.iter().zip(inverse.row_iter()) {
            let standard_error = residual.map(|residual| residual * row.norm() / unit);
            coefficients.push(Coefficient { value: value / unit, standard_error });
            unit *= scale;
        }
        Some(Self { coefficients, residual, degrees_of_freedom })
    }

    /// The polynomial's value.
    pub fn at(&self, x: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient.value)
    }
}

#[cfg(test)]
#[path = "fit_tests.rs"]
mod tests;
