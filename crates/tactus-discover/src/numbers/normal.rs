//! The upper tail of the normal distribution.

use std::f64::consts::FRAC_1_SQRT_2;

/// Beyond this deviate the tail is nearly its density over the deviate.
const FAR: f64 = 30.0;
const HALVINGS: usize = 60;

/// Probability of a greater standard normal number.
pub(crate) fn upper_tail(z: f64) -> f64 {
    0.5 * libm::erfc(z * FRAC_1_SQRT_2)
}

/// The deviate that counts of one that was picked as the greatest of many: its probability times their number (Bonferroni); not negative.
/// However they depend on each other and whatever the rule of the pick, it is not too great.
pub(crate) fn of_picked(z: f64, among: f64) -> f64 {
    if among <= 1.0 {
        return z;
    }
    if z > FAR {
        return (z * z - 2.0 * among.ln()).max(0.0).sqrt();
    }
    let tail = among * upper_tail(z);
    if tail >= upper_tail(0.0) {
        return 0.0;
    }
    let (mut least, mut most) = (0.0, z);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(least, most);
        if upper_tail(middle) > tail { least = middle } else { most = middle }
    }
    least
}

#[cfg(test)]
#[path = "normal_tests.rs"]
mod tests;
