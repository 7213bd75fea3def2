//! The median.

/// Standard deviation of a normal distribution with a median absolute deviation of 1.
pub(crate) const NORMAL_PER_MEDIAN: f64 = 1.482_602_2;

/// The median; 0 of no values.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => 0.0,
        count if count % 2 == 1 => sorted[middle],
        _ => f64::midpoint(sorted[middle - 1], sorted[middle]),
    }
}
