//! Maximum of a function.

/// Position of the maximum of `f`, which has one peak in `[low, high]`, to 1e-7 of `high`.
pub(crate) fn peak([mut low, mut high]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let close = 1e-7 * high;
    while high - low > close {
        let (left, right) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if f(left) < f(right) { low = left } else { high = right }
    }
    f64::midpoint(low, high)
}
