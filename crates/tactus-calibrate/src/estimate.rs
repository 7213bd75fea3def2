//! A number with its standard error.

use serde::Serialize;

/// 0.975 quantile of the standard normal distribution: a 95 % interval reaches this many standard errors each way.
const Z_95: f64 = 1.959_963_984_540_054;

/// An estimated number with its standard error; both in the same unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The estimate itself.
    pub value: f64,
    /// Standard deviation of the estimate's error.
    pub standard_error: f64,
}

impl Estimate {
    /// An estimate of known variance; negative variances, which rounding can cause, count as 0.
    pub(crate) fn new(value: f64, variance: f64) -> Self {
        Self { value, standard_error: variance.max(0.0).sqrt() }
    }

    /// The 95 % interval of a normally distributed estimate: 1.96 standard errors each way.
    pub fn interval(&self) -> [f64; 2] {
        let reach = Z_95 * self.standard_error;
        [self.value - reach, self.value + reach]
    }

    /// True if the 95 % interval contains `truth`.
    pub fn covers(&self, truth: f64) -> bool {
        (truth - self.value).abs() <= Z_95 * self.standard_error
    }

    /// The same in another unit, which is `unit` times the present one.
    #[must_use]
    pub fn in_units_of(&self, unit: f64) -> Self {
        Self { value: self.value / unit, standard_error: self.standard_error / unit.abs() }
    }
}
