//! Quantiles for bounds.

/// The 95 % quantile of the standard normal distribution.
pub(crate) const Z_95: f64 = 1.644_854;

/// The 95 % quantile of Student's distribution for a mean over presses.
///
/// # Source
/// M. Abramowitz and I. A. Stegun, *Handbook of Mathematical Functions* (1964), 26.7.5.
pub(crate) fn student_95(presses: usize) -> f64 {
    let (z, freedom) = (Z_95, presses.saturating_sub(1).max(1) as f64);
    let square = z * z;
    let terms = [
        z,
        z * (square + 1.0) / 4.0,
        z * ((5.0 * square + 16.0) * square + 3.0) / 96.0,
        z * (((3.0 * square + 19.0) * square + 17.0) * square - 15.0) / 384.0,
    ];
    terms.into_iter().rev().fold(0.0, |sum, term| sum / freedom + term)
}

#[cfg(test)]
#[path = "quantiles_tests.rs"]
mod tests;
