//! Shares with their intervals, and the statistical functions that the evidence needs.

use serde::Serialize;

/// A binomial share with its exact 95 % interval (Clopper and Pearson 1934).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// Number of hits.
    pub hits: usize,
    /// Number of trials.
    pub of: usize,
    /// `hits / of`; NaN without trials.
    pub share: f64,
    /// Ends of the interval; 0 and 1 without trials.
    pub interval: [f64; 2],
}

/// Probability outside each end of the interval.
const TAIL: f64 = 0.025;
/// Halvings of `[0, 1]`; the result is finer than the printed precision.
const HALVINGS: usize = 50;

impl Rate {
    /// The share of `hits` in `of`.
    pub fn new(hits: usize, of: usize) -> Self {
        let least = if hits == 0 { 0.0 } else { root(|p| at_most(hits - 1, of, p) - (1.0 - TAIL)) };
        let most = if hits >= of { 1.0 } else { root(|p| at_most(hits, of, p) - TAIL) };
        Self { hits, of, share: hits as f64 / of as f64, interval: [least, most] }
    }

    /// The share of items for which `is_so` holds.
    pub fn of<T>(all: impl IntoIterator<Item = T>, is_so: impl Fn(T) -> bool) -> Self {
        let (mut hits, mut of) = (0, 0);
        for one in all {
            of += 1;
            hits += usize::from(is_so(one));
        }
        Self::new(hits, of)
    }
}

/// The zero of a function that falls over `[0, 1]`.
fn root(falling: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if falling(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

/// Probability of at most `hits` in `of` trials, each with probability `p`.
fn at_most(hits: usize, of: usize, p: f64) -> f64 {
    let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    let term = |k: usize| {
        let ways = ln_factorial(of) - ln_factorial(k) - ln_factorial(of - k);
        (ways + k as f64 * p.ln() + (of - k) as f64 * (-p).ln_1p()).exp()
    };
    (0..=hits).map(term).sum()
}

/// The normal distribution function: the share of standard normal deviates below `x`.
pub fn normal_share(x: f64) -> f64 {
    0.5 * libm::erfc(-x / std::f64::consts::SQRT_2)
}

/// The value below which a share of all values lies, linear between neighbours; `None` without values.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the values")]
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let place = share * values.len().checked_sub(1)? as f64;
    let below = values[place as usize];
    let above = values[(place.ceil() as usize).min(values.len() - 1)];
    Some(below + place.fract() * (above - below))
}

#[cfg(test)]
#[path = "rate_tests.rs"]
mod tests;
