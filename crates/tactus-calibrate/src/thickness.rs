//! Spread against the covering's thickness (paper, Eq. 4 and Fig. 5a).
//!
//! ```text
//! linear      sigma+ = a + b t
//! quadratic   sigma+ = a + b t + c t^2
//! ```
//!
//! through the spreads of all coverings and depths with equal weights, as in the paper. The standard errors come from the
//! covariance of the spreads: `(X^T X)^-1 X^T C X (X^T X)^-1`. If the points scatter about the line by more than
//! their own errors explain, the errors are widened accordingly, and the fit says so.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::{Estimate, placement::same_covering, spread::Spreads};

/// A scatter whose p-value is below this is not taken as random.
pub(crate) const IMPLAUSIBLE: f64 = 1e-3;

/// Spread of each covering, and its dependence on thickness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ThicknessFit {
    /// Each covering's spread, the mean over its depths.
    pub coverings: Vec<CoveringSpread>,
    /// `a` in mm and `b`; `None` with a single covering.
    pub linear: Option<Curve<2>>,
    /// `a` in mm, `b`, and `c` in 1/mm; `None` with fewer than three coverings.
    pub quadratic: Option<Curve<3>>,
}

/// The spread of one covering.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoveringSpread {
    /// Thickness of the covering.
    pub covering_mm: f64,
    /// Mean over its depths.
    pub sigma_mm: Estimate,
    /// Greatest difference between two of its depths.
    pub range_mm: f64,
    /// P-value of the differences between depths if the spread does not depend on depth; `None` with one depth.
    #[serde(rename = "chance")]
    pub p_value: Option<f64>,
}

/// A polynomial in thickness with `N` coefficients, that of `t^0` first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve<const N: usize> {
    /// In mm, then with one power of mm less each.
    #[serde(serialize_with = "as_list")]
    pub coefficients: [Estimate; N],
    /// Root mean square distance of the points from it, in mm.
    pub rms_mm: f64,
    /// P-value of the scatter if the polynomial holds; `None` without degrees of freedom.
    #[serde(rename = "chance")]
    pub p_value: Option<f64>,
}

fn as_list<const N: usize, S: serde::Serializer>(values: &[Estimate; N], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(values)
}

impl<const N: usize> Curve<N> {
    /// Spread at a thickness, in mm.
    pub fn at(&self, covering_mm: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * covering_mm + coefficient.value)
    }
}

/// Fits spread against thickness; `None` without spreads.
pub(crate) fn against_thickness(spreads: &Spreads) -> Option<ThicknessFit> {
    let mut rows: Vec<usize> = (0..spreads.fits.len()).collect();
    rows.sort_by(|one, other| spreads.fits[*one].covering_mm.total_cmp(&spreads.fits[*other].covering_mm));
    let thickness = |row: &usize| spreads.fits[*row].covering_mm;
    let alike = |one: &usize, other: &usize| same_covering(thickness(one), thickness(other));
    let coverings: Vec<_> = rows.chunk_by(alike).map(|rows| covering(spreads, rows)).collect();
    let count = coverings.len();
    (count > 0).then(|| ThicknessFit {
        linear: (count >= 2).then(|| curve(spreads)).flatten(),
        quadratic: (count >= 3).then(|| curve(spreads)).flatten(),
        coverings,
    })
}

fn covering(spreads: &Spreads, rows: &[usize]) -> CoveringSpread {
    let count = rows.len() as f64;
    let sigmas = rows.iter().map(|row| spreads.fits[*row].sigma_mm.value);
    let [least, most] = sigmas
        .clone()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], sigma| [least.min(sigma), most.max(sigma)]);
    let pairs = rows.iter().flat_map(|row| rows.iter().map(move |column| (*row, *column)));
    let variance: f64 = pairs.map(|pair| spreads.covariance[pair]).sum::<f64>() / (count * count);
    CoveringSpread {
        covering_mm: spreads.fits[rows[0]].covering_mm,
        sigma_mm: Estimate::new(sigmas.sum::<f64>() / count, variance),
        range_mm: most - least,
        p_value: p_value(
            &spreads_of(spreads, rows),
            &DMatrix::from_element(rows.len(), 1, 1.0),
            &among(spreads, rows),
        ),
    }
}

fn curve<const N: usize>(spreads: &Spreads) -> Option<Curve<N>> {
    let rows: Vec<usize> = (0..spreads.fits.len()).collect();
    let design = DMatrix::from_fn(rows.len(), N, |row, power| {
        let power = i32::try_from(power).unwrap_or(i32::MAX);
        spreads.fits[row].covering_mm.powi(power)
    });
    let (sigmas, covariance) = (spreads_of(spreads, &rows), among(spreads, &rows));
    let solve = (design.transpose() * &design).try_inverse()? * design.transpose();
    let coefficients = &solve * &sigmas;
    let residuals = &sigmas - &design * &coefficients;
    let p_value = p_value(&sigmas, &design, &covariance);
    let mut spread = &solve * covariance * solve.transpose();
    if p_value.is_some_and(|p_value| p_value < IMPLAUSIBLE) {
        let freedom = rows.len() as f64 - N as f64;
        let scatter = residuals.norm_squared() / freedom;
        spread += &solve * solve.transpose() * scatter;
    }
    Some(Curve {
        coefficients: std::array::from_fn(|power| Estimate::new(coefficients[power], spread[(power, power)])),
        rms_mm: (residuals.norm_squared() / rows.len() as f64).sqrt(),
        p_value,
    })
}

fn spreads_of(spreads: &Spreads, rows: &[usize]) -> DVector<f64> {
    DVector::from_iterator(rows.len(), rows.iter().map(|row| spreads.fits[*row].sigma_mm.value))
}

fn among(spreads: &Spreads, rows: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows.len(), |row, column| spreads.covariance[(rows[row], rows[column])])
}

/// Probability that values with this covariance scatter as much or more about the model of this design: the upper tail of
/// chi-squared at the least generalised sum of squares. `None` without degrees of freedom.
fn p_value(values: &DVector<f64>, design: &DMatrix<f64>, covariance: &DMatrix<f64>) -> Option<f64> {
    let freedom = design.nrows().checked_sub(design.ncols()).filter(|freedom| *freedom > 0)?;
    let inverse = covariance.clone().cholesky()?.inverse();
    let weighted = design.transpose() * &inverse;
    let best = (&weighted * design).cholesky()?.solve(&(weighted * values));
    let residuals = values - design * best;
    Some(chi_squared_beyond(freedom, (residuals.transpose() * inverse * residuals)[0]))
}

/// Upper tail of the chi-squared distribution, by its finite series.
fn chi_squared_beyond(freedom: usize, value: f64) -> f64 {
    let half = value.max(0.0) / 2.0;
    let (mut tail, mut term, mut order) = if freedom.is_multiple_of(2) {
        (0.0, (-half).exp(), 0.0)
    } else {
        (libm::erfc(half.sqrt()), (-half).exp() * (half / std::f64::consts::PI).sqrt() * 2.0, 0.5)
    };
    // Q(order + 1) = Q(order) + half^order exp(-half) / Gamma(order + 1)
    while order < freedom as f64 / 2.0 - 0.25 {
        tail += term;
        order += 1.0;
        term *= half / order;
    }
    tail.min(1.0)
}

#[cfg(test)]
#[path = "thickness_tests.rs"]
mod tests;
