//! The median.

/// Standard deviation of a normal distribution with a median absolute deviation of 1.
pub(crate) const NORMAL_PER_MEDIAN: f64 = 1.482_602_2;

/// The median; 0 of no values.
pub(crate) fn median(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let mut ordered = values.to_vec();
    let (below, upper, _) = ordered.select_nth_unstable_by(values.len() / 2, f64::total_cmp);
    match below.iter().copied().max_by(f64::total_cmp) {
        Some(lower) if values.len().is_multiple_of(2) => f64::midpoint(lower, *upper),
        _ => *upper,
    }
}

#[cfg(test)]
#[path = "median_tests.rs"]
mod tests;
