//! Numbers of G-code, written so that a damaged byte costs little.

/// Rounds to the controller's three decimals; no negative zero.
pub(super) fn round_to_um(mm: f64) -> f64 {
    (mm * 1000.0).round() / 1000.0 + 0.0
}

/// A number with at most three decimals, without redundant zeros: `-.1`, `12`, `.005`.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    let (sign, digits) = text.strip_prefix('-').map_or(("", text), |digits| ("-", digits));
    let digits = if digits == "0" { digits } else { digits.strip_prefix('0').unwrap_or(digits) };
    format!("{sign}{digits}")
}

#[cfg(test)]
#[path = "number_tests.rs"]
mod tests;
