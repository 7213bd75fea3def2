//! Numbers for people.

use tactus_calibrate::Estimate;

use crate::plot::number;

/// Digits after which no number here means anything.
const DECIMALS_MAX: f64 = 9.0;

/// A whole number with its thousands apart.
pub(crate) fn count(value: u64) -> String {
    number(value as f64, 0)
}

/// `1 gap`, `2 gaps`.
pub(crate) fn plural(value: u64, noun: &str) -> String {
    format!("{} {noun}{}", count(value), if value == 1 { "" } else { "s" })
}

/// A time span in the two units that matter.
pub(crate) fn duration(seconds: f64) -> String {
    if seconds < 59.95 {
        return format!("{} s", number(seconds, 1));
    }
    let whole = seconds.round();
    let (hours, minutes) = ((whole / 3600.0).floor(), (whole % 3600.0 / 60.0).floor());
    if hours > 0.0 { format!("{hours} h {minutes} min") } else { format!("{minutes} min {} s", whole % 60.0) }
}

/// A number to so many decimals at most, without zeros at its end: `1.016`, `2.54`, `20`.
pub(crate) fn short(value: f64, decimals: usize) -> String {
    let text = number(value, decimals);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A number to so many digits, wherever its point is.
pub(crate) fn digits(value: f64, digits: u32) -> String {
    number(value, decimals(value.abs(), digits))
}

/// A value and its standard error, to the digits that the error leaves: `2.7256 ± 0.0007`.
///
/// The error has two digits if its first three are below 355, otherwise one: the rounding of the particle data group.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    if !(error > 0.0 && error.is_finite()) {
        return digits(value, 4);
    }
    let decimals = of_error(error);
    format!("{} \u{b1} {}", number(value, decimals), number(error, decimals))
}

/// The same of an [`Estimate`].
pub(crate) fn estimate(estimate: &Estimate) -> String {
    with_error(estimate.value, estimate.standard_error)
}

/// Its 95 % interval, to the digits of its error; a dash if it has no error.
pub(crate) fn interval(estimate: &Estimate) -> String {
    let error = estimate.standard_error;
    if !(error > 0.0 && error.is_finite()) {
        return "\u{2013}".into();
    }
    let [lo, hi] = estimate.interval().map(|end| number(end, of_error(error)));
    format!("{lo} to {hi}")
}

/// A difference that an error belongs to, with its sign.
pub(crate) fn difference(value: f64, error: f64) -> String {
    let text = number(value, of_error(error));
    if text.starts_with(|c: char| c.is_ascii_digit()) { format!("+{text}") } else { text }
}

/// A chance; below one in a thousand it is only said to be so small.
pub(crate) fn chance(chance: f64) -> String {
    if chance < 1e-3 { "< 0.001".into() } else { number(chance, 3) }
}

/// Decimals for a value of this error.
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
