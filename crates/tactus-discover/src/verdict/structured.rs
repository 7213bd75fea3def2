//! How much of a residual is structured, that is, not noise, with an upper bound.
//!
//! With a residual `x` in units of the noise on held-out presses, noise that is known from repeats, and a lag after which it
//! has forgotten itself,
//!
//! ```text
//! S1 = mean of x(t) x(t + lag) - rho(lag)        sees what lasts longer than the lag, and hardly uses the size of the noise
//! S2 = mean of x(t)^2 - 1                        sees everything
//! ```
//!
//! Their standard errors are those of a jackknife over presses, since what is structured is alike within a press. To that of `S2`
//! the uncertainty of the noise adds the variance `2 (1 + S2)^2 / freedom`. With `t` the 95 % quantile of Student's distribution,
//!
//! ```text
//! upper = sqrt(max(0, S1 + t error1, S2 + t error2))
//! ```
//!
//! The errors of the fit are structure too: they stay in the bound.
//!
//! # Source
//! Jackknife: B. Efron, *The Jackknife, the Bootstrap and Other Resampling Plans* (1982), ch. 3.

use std::ops::{Range, RangeInclusive};

use crate::fit::LOUD;
use crate::numbers::student_95;

/// The part of a model's residuals on held-out presses that is not noise.
///
/// It is measured among all readings and among those with a signal. The part with the greater bound is given: readings far
/// from the tip would hide what is wrong near it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Structured {
    /// Root mean square, in standard deviations of the noise.
    pub rms_noise: f64,
    /// Upper 95 % bound of `rms_noise`; infinite with fewer than three held-out presses.
    pub upper_noise: f64,
    /// True if it is that of the readings with a signal.
    pub with_signal: bool,
}

/// Least number of presses for a bound.
const PRESSES_LEAST: usize = 3;

/// The readings of which a residual is examined, and their noise.
pub(crate) struct Readings<'a> {
    pub(crate) elements: usize,
    /// In counts: frame by frame, element by element.
    pub(crate) residual: &'a [f32],
    /// As predicted, in counts, for the same.
    pub(crate) signal: &'a [f32],
    /// Frames of each press, or of each rest between presses.
    pub(crate) presses: &'a [Range<usize>],
    /// Standard deviation of the noise of each element; infinite for those without weight.
    pub(crate) noise_counts: &'a [f64],
    /// Unit of each element's residual: its noise, or more for an element that is quieter than most.
    pub(crate) unit_counts: &'a [f64],
    /// Frames after which the noise has forgotten itself, and the correlation that is left.
    pub(crate) lag: usize,
    pub(crate) correlation: f64,
    /// What rounding adds to that, the same for the same signal. Where there is no signal, the baseline takes it up.
    pub(crate) rounding_share: f64,
    /// Degrees of freedom of the noise.
    pub(crate) freedom: f64,
}

/// Sums over the readings of one press: of a quantity, and of readings.
pub(super) type Sums = [f64; 2];

impl Readings<'_> {
    /// What is structured among the readings that `among` selects by their place in the residual; `None` if there are none.
    pub(crate) fn structured(&self, among: impl Fn(usize) -> bool) -> Option<Structured> {
        let sums: Vec<[Sums; 2]> = self.presses.iter().map(|press| self.sums(press, &among)).collect();
        let [lasting, all] = [0, 1].map(|which| {
            sums.iter().map(|of| of[which]).filter(|[_, count]| *count > 0.0).collect::<Vec<Sums>>()
        });
        let (value, error) = jackknife(&all)?;
        let error = self.with_noise(value, error);
        let mut found = Structured {
            rms_noise: value.max(0.0).sqrt(),
            upper_noise: (value + student_95(all.len()) * error).max(0.0).sqrt(),
            with_signal: false,
        };
        if let Some((value, error)) = jackknife(&lasting).filter(|(_, error)| error.is_finite()) {
            let upper = value + student_95(lasting.len()) * error;
            found.rms_noise = found.rms_noise.max(value.max(0.0).sqrt());
            found.upper_noise = found.upper_noise.max(upper.max(0.0).sqrt());
        }
        Some(found)
    }

    /// The standard error of a mean of squares, with that of the noise.
    pub(super) fn with_noise(&self, value: f64, error: f64) -> f64 {
        error.hypot((2.0 / self.freedom).sqrt() * (1.0 + value))
    }

    /// The residual at a place in this unit, if it is among those that are examined.
    fn value(&self, place: usize, unit: f64, among: impl Fn(usize) -> bool) -> Option<f64> {
        among(place).then(|| f64::from(self.residual[place]) / unit)
    }

    /// The correlation of a reading's noise with a later one, where the noise itself has this one left.
    fn lasting(&self, correlation: f64, place: usize, noise_counts: f64) -> f64 {
        let has_signal = f64::from(self.signal[place].abs()) > LOUD * noise_counts;
        correlation + if has_signal { self.rounding_share } else { 0.0 }
    }

    /// Lags at which nothing of the noise is left, of which each shows what lasts: for this many frames of memory. A correlation that is
    /// measured there is no more than its own error, which is of the size of a gap far below the noise.
    pub(super) const fn late(lag: usize) -> RangeInclusive<usize> {
        3 * lag..=9 * lag
    }

    /// The products of readings at late lags, less those of the noise, and their number.
    pub(super) fn late_sums(&self, press: &Range<usize>, among: impl Fn(usize) -> bool) -> Sums {
        let mut sums = [0.0; 2];
        let elements = self.noise_counts.iter().zip(self.unit_counts).enumerate();
        for (element, (noise, unit)) in elements.filter(|(_, (noise, _))| noise.is_finite()) {
            let variance = (noise / unit).powi(2);
            let value = |frame: usize| {
                let place = frame * self.elements + element;
                let own = variance * self.lasting(0.0, place, *noise);
                self.value(place, *unit, &among).map(|value| (value, own))
            };
            let values: Vec<Option<(f64, f64)>> = press.clone().map(value).collect();
            for lag in Self::late(self.lag) {
                let pairs = values.iter().zip(values.iter().skip(lag));
                for ((now, own), (then, _)) in pairs.filter_map(|(now, then)| now.zip(*then)) {
                    sums[0] += now * then - own;
                    sums[1] += 1.0;
                }
            }
        }
        sums
    }

    /// The products of readings a lag apart, and the squares of readings, less those of the noise.
    pub(super) fn sums(&self, press: &Range<usize>, among: impl Fn(usize) -> bool) -> [Sums; 2] {
        let (mut lasting, mut all) = ([0.0; 2], [0.0; 2]);
        let elements = self.noise_counts.iter().zip(self.unit_counts).enumerate();
        for (element, (noise, unit)) in elements.filter(|(_, (noise, _))| noise.is_finite()) {
            let variance = (noise / unit).powi(2);
            let value = |frame: usize| self.value(frame * self.elements + element, *unit, &among);
            for frame in press.clone() {
                let Some(now) = value(frame) else { continue };
                all[0] += now * now - variance;
                all[1] += 1.0;
                let then = frame + self.lag;
                if let Some(then) = press.contains(&then).then(|| value(then)).flatten() {
                    let own = self.lasting(self.correlation, frame * self.elements + element, *noise);
                    lasting[0] += now * then - own * variance;
                    lasting[1] += 1.0;
                }
            }
        }
        [lasting, all]
    }
}

/// A mean over the readings of presses, and its standard error; `None` of no readings. The error of few presses is infinite.
pub(super) fn jackknife(presses: &[Sums]) -> Option<(f64, f64)> {
    let [sum, readings] = presses.iter().fold([0.0; 2], |[sum, count], [s, c]| [sum + s, count + c]);
    let count = presses.len() as f64;
    let without: Vec<f64> = presses.iter().map(|[s, c]| (sum - s) / (readings - c)).collect();
    let mean = without.iter().sum::<f64>() / count;
    let spread: f64 = without.iter().map(|one| (one - mean).powi(2)).sum();
    let error =
        if presses.len() < PRESSES_LEAST { f64::INFINITY } else { (spread * (count - 1.0) / count).sqrt() };
    (readings > 0.0).then(|| (sum / readings, error))
}

#[cfg(test)]
#[path = "structured_tests.rs"]
mod tests;
