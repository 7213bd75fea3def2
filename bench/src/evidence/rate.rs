//! Shares with their intervals, and the few functions of statistics that the evidence needs.

use serde::Serialize;

/// So many of so many, with the exact interval of 95 % (Clopper and Pearson 1934).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Rate {
    /// How many.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
    /// `hits / of`; not a number of none.
    pub share: f64,
    /// Ends of the interval; 0 and 1 of none.
    pub interval: [f64; 2],
}

/// Chance of each end of the interval.
const TAIL: f64 = 0.025;
/// Halvings of `[0, 1]`: beyond the precision of what is printed.
const HALVINGS: usize = 50;

impl Rate {
    /// So many of so many.
    pub fn new(hits: usize, of: usize) -> Self {
        let least = if hits == 0 { 0.0 } else { root(|p| at_most(hits - 1, of, p) - (1.0 - TAIL)) };
        let most = if hits >= of { 1.0 } else { root(|p| at_most(hits, of, p) - TAIL) };
        Self { hits, of, share: hits as f64 / of as f64, interval: [least, most] }
    }

    /// How many of some are so.
    pub fn of<T>(all: impl IntoIterator<Item = T>, is_so: impl Fn(T) -> bool) -> Self {
        let (mut hits, mut of) = (0, 0);
        for one in all {
            of += 1;
            hits += usize::from(is_so(one));
        }
        Self::new(hits, of)
    }
}

/// Where a function that falls over `[0, 1]` is zero.
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

/// Chance of at most `hits` of `of`, each with chance `p`.
fn at_most(hits: usize, of: usize, p: f64) -> f64 {
    let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    let term = |k: usize| {
        let ways = ln_factorial(of) - ln_factorial(k) - ln_factorial(of - k);
        (ways + k as f64 * p.ln() + (of - k) as f64 * (-p).ln_1p()).exp()
    };
    (0..=hits).map(term).sum()
}

/// The normal distribution function: share of standard normal deviates below `x`.
pub fn normal_share(x: f64) -> f64 {
    0.5 * libm::erfc(-x / std::f64::consts::SQRT_2)
}

/// The value below which a share of all lies, linear between neighbours; none of none.
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
