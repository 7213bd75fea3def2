//! Formatting of numbers.

use tactus_calibrate::Estimate;

use crate::plot::number;

/// Decimals at most.
const DECIMALS_MAX: f64 = 9.0;

/// A whole number with separated thousands.
pub(crate) fn count(value: u64) -> String {
    number(value as f64, 0)
}

/// `1 gap`, `2 gaps`.
pub(crate) fn plural(value: u64, noun: &str) -> String {
    format!("{} {noun}{}", count(value), if value == 1 { "" } else { "s" })
}

/// A time span in its two largest units.
pub(crate) fn duration(seconds: f64) -> String {
    if seconds < 59.95 {
        return format!("{} s", number(seconds, 1));
    }
    let whole = seconds.round();
    let (hours, minutes) = ((whole / 3600.0).floor(), (whole % 3600.0 / 60.0).floor());
    if hours > 0.0 { format!("{hours} h {minutes} min") } else { format!("{minutes} min {} s", whole % 60.0) }
}

/// A number with at most this many decimals, without trailing zeros: `1.016`, `2.54`, `20`.
pub(crate) fn short(value: f64, decimals: usize) -> String {
    let text = number(value, decimals);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A number with this many significant digits.
pub(crate) fn digits(value: f64, digits: u32) -> String {
    number(value, decimals(value.abs(), digits))
}

/// A value and its standard error, rounded to the error: `2.7256 ± 0.0007`.
///
/// The error has two digits if its first three are below 355, otherwise one: the rounding of the particle data group.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    if !(error > 0.0 && error.is_finite()) {
        return digits(value, 4);
    }
    let decimals = of_error(error);
    format!("{} \u{b1} {}", number(value, decimals), number(error, decimals))
}

/// [`with_error`] of an [`Estimate`].
pub(crate) fn estimate(estimate: &Estimate) -> String {
    with_error(estimate.value, estimate.standard_error)
}

/// The 95 % interval, rounded to the error; a dash without an error.
pub(crate) fn interval(estimate: &Estimate) -> String {
    let error = estimate.standard_error;
    if !(error > 0.0 && error.is_finite()) {
        return "\u{2013}".into();
    }
    let [lo, hi] = estimate.interval().map(|end| number(end, of_error(error)));
    format!("{lo} to {hi}")
}

/// A signed difference, rounded to an error.
pub(crate) fn difference(value: f64, error: f64) -> String {
    let text = number(value, of_error(error));
    if text.starts_with(|c: char| c.is_ascii_digit()) { format!("+{text}") } else { text }
}

/// A probability; below 0.001 only the bound.
pub(crate) fn probability(value: f64) -> String {
    if value < 1e-3 { "< 0.001".into() } else { number(value, 3) }
}

/// Decimals for a value with this error.
fn of_error(error: f64) -> usize {
    let leading = error / 10_f64.powf(error.log10().floor());
    decimals(error, if leading < 3.55 { 2 } else { 1 })
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and DECIMALS_MAX")]
fn decimals(value: f64, digits: u32) -> usize {
    let before = if value > 0.0 && value.is_finite() { value.log10().floor() } else { 0.0 };
    (f64::from(digits) - 1.0 - before).clamp(0.0, DECIMALS_MAX) as usize
}

#[cfg(test)]
#[path = "numbers_tests.rs"]
mod tests;
