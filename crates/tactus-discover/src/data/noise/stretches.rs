//! The noise from stretches of rest that are too short for the plateau of `D`, such as dwells of a quarter of a second.
//!
//! A difference over `k` frames misses the part of the noise that changes more slowly. For first-order autoregressive noise
//! with coefficient `phi` that part is known:
//!
//! ```text
//! D(k) = noise^2 (1 - phi^k)        k = 1, 2, ..., longest
//! ```
//!
//! Both parameters are fitted to the `D` of all elements, less what rounding to steps adds ([`before_rounding`]). The noise counts as known if its correlation falls to `1 / e` within
//! the longest lag. Within a dwell a covering relaxes, so only readings count whose mean in the stretch is near the element's
//! zero. The standard error is that of a jackknife over groups of stretches.
//!
//! # Source
//! G. E. P. Box, G. M. Jenkins, *Time Series Analysis* (1970), ch. 3 (autoregression); B. Efron, *The Jackknife, the Bootstrap
//! and Other Resampling Plans* (1982), ch. 3.

use std::f64::consts::E;
use std::ops::Range;

use super::{ALIKE_Z, Noise, PAIRS_LEAST, bias_variance, pooled, repeated_frames};
use crate::data::converter::{ROUNDED_MAX, is_exact, is_whole};
use crate::data::frames::Frames;
use crate::data::motion::CLEAR_MM;
use crate::numbers::median;

/// Least of the longest lag, in frames. A shorter rise is no measure of autocorrelation.
const LONGEST_LEAST: usize = 4;
/// Greatest lag, in frames.
const LAGS: usize = 30;
/// Coefficients that are tried: from 0 in steps.
const PHI_STEP: f64 = 0.005;
const PHI_STEPS: u32 = 196;
/// A mean is near zero within this many lower quartiles of all distances: 1.6 standard deviations if no reading has a signal, and
/// 3.4 if half of them have one.
const NEAR_QUARTILES: f64 = 5.0;
/// Pairs of neighbouring frames for one independent pair, at the greatest autocorrelation that short dwells can show.
const FRAMES_EACH: f64 = 10.0;
/// Halvings of the interval in which `D` before rounding lies.
const HALVINGS: usize = 20;
/// Groups of stretches of the jackknife.
const GROUPS: usize = 20;
/// First-order autoregressive noise.
#[derive(Debug, Clone, Copy)]
struct Autoregression {
    variance: f64,
    phi: f64,
}

/// Sums over pairs of readings: for each element, for each lag from one frame on.
#[derive(Debug, Clone)]
struct Differences {
    /// Half the squares of differences.
    squares: Vec<[f64; LAGS]>,
    pairs: Vec<[f64; LAGS]>,
}

/// The noise, and its degrees of freedom. `None` if the stretches are too short for its correlation.
pub(super) fn noise(
    frames: &Frames,
    values: &[f32],
    still: &[usize],
    step_counts: f64,
) -> Option<(Noise, f64)> {
    let groups = differences(frames, values, &stretches(frames, still), step_counts);
    let mut whole = Differences::none(frames.elements);
    for group in &groups {
        whole.add(group, 1.0);
    }
    let least = (PAIRS_LEAST * frames.elements) as f64 / 2.0;
    let pairs = |lag: usize| whole.pairs.iter().map(|of| of[lag - 1]).sum::<f64>();
    let longest = (LONGEST_LEAST..=LAGS).rev().find(|lag| pairs(*lag) >= least)?;
    let units = whole.units(longest);
    let step_counts = if is_in_steps(frames, step_counts) { step_counts } else { 0.0 };
    let fit = |of: &Differences| {
        let unit = median(&units).max(f64::MIN_POSITIVE);
        let before = |[pairs, d]: [f64; 2]| [pairs, before_rounding(d * unit, step_counts) / unit];
        Autoregression::of(&of.rise(&units, longest).into_iter().map(before).collect::<Vec<_>>())
    };
    let fitted = fit(&whole);
    if fitted.at(longest) > 1.0 / E {
        return None;
    }

    let without = |group: &Differences| {
        let mut without = whole.clone();
        without.add(group, -1.0);
        fit(&without).variance
    };
    let without: Vec<f64> = groups.iter().map(without).collect();
    let count = without.len() as f64;
    let mean = without.iter().sum::<f64>() / count;
    let spread = without.iter().map(|one| (one - mean).powi(2)).sum::<f64>() * (count - 1.0) / count;
    let rounding = step_counts * step_counts / 12.0;
    let variance = |unit: &f64| (unit * fitted.variance + rounding).max(f64::MIN_POSITIVE);
    let variances: Vec<f64> = units.iter().map(variance).collect();
    let typical = median(&variances);
    let total = fitted.variance + rounding / median(&units).max(f64::MIN_POSITIVE);
    let freedom = 2.0 * total * total / spread.max(f64::MIN_POSITIVE);
    let share = 1.0 - rounding / typical;
    let correlation = |lag: usize| if lag == 0 { 1.0 } else { share * fitted.at(lag) };
    let noise = Noise {
        rms_counts: typical.sqrt(),
        by_element_counts: variances.iter().map(|variance| variance.sqrt()).collect(),
        correlation: (0..=10 * LAGS).map(correlation).take_while(|rho| *rho > 1e-3).collect(),
        rounding_share: bias_variance(typical - rounding, step_counts) / typical,
        repeated_frames: repeated_frames(frames, still),
    };
    Some((noise, freedom))
}

/// The stretches of frames in which the tip is at rest, with at least one pair of frames.
pub(super) fn stretches(frames: &Frames, still: &[usize]) -> Vec<Range<usize>> {
    let starts: Vec<usize> = (0..frames.len()).filter(|frame| still[*frame] == 0).collect();
    let ends = starts.iter().skip(1).copied().chain([frames.len()]);
    starts.iter().copied().zip(ends).map(|(start, end)| start..end).collect()
}

/// Differences within the stretches, of the readings near zero, in groups of stretches.
fn differences(
    frames: &Frames,
    values: &[f32],
    stretches: &[Range<usize>],
    step_counts: f64,
) -> Vec<Differences> {
    let elements = frames.elements;
    let unit_counts = Noise::of_differences(frames, step_counts).by_element_counts;
    let stretches: Vec<&Range<usize>> = stretches.iter().filter(|one| one.len() > 1).collect();
    let zeros = zeros(frames, values);
    let run_of = |frame: usize| frames.runs.iter().position(|(_, end)| frame < *end).unwrap_or(0);
    let reading = |frame: usize, element: usize| f64::from(values[frame * elements + element]);
    let aside: Vec<f64> = stretches
        .iter()
        .flat_map(|stretch| {
            let zero = &zeros[run_of(stretch.start)];
            let of = |element: usize| {
                let sum: f64 = (stretch.start..stretch.end).map(|frame| reading(frame, element)).sum();
                (sum / stretch.len() as f64 - zero[element]).abs() / unit_counts[element]
            };
            (0..elements).map(of).collect::<Vec<f64>>()
        })
        .collect();
    let mut sorted = aside.clone();
    sorted.sort_by(f64::total_cmp);
    let near = NEAR_QUARTILES * sorted.get(sorted.len() / 4).copied().unwrap_or(0.0);
    let mut groups = vec![Differences::none(elements); GROUPS.min(stretches.len())];
    for (nth, (stretch, aside)) in stretches.iter().zip(aside.chunks_exact(elements)).enumerate() {
        let Differences { squares, pairs } = &mut groups[nth % GROUPS];
        for element in (0..elements).filter(|element| aside[*element] <= near) {
            for lag in 1..stretch.len().min(LAGS + 1) {
                let of = |frame: usize| (reading(frame + lag, element) - reading(frame, element)).powi(2);
                squares[element][lag - 1] += (stretch.start..stretch.end - lag).map(of).sum::<f64>() / 2.0;
                pairs[element][lag - 1] += (stretch.len() - lag) as f64;
            }
        }
    }
    groups
}

/// `D` of readings before they were rounded. Each of two readings has the variance `step^2 / 12` of rounding; [`bias_variance`] is the
/// part that both have in common.
fn before_rounding(d: f64, step_counts: f64) -> f64 {
    let rounding = step_counts * step_counts / 12.0;
    let [mut least, mut most] = [(d - rounding).max(0.0), d];
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(least, most);
        if middle + rounding - bias_variance(middle, step_counts) < d {
            least = middle;
        } else {
            most = middle;
        }
    }
    f64::midpoint(least, most)
}

/// True if nearly all readings of an element are whole steps apart. Means of several readings are not.
fn is_in_steps(frames: &Frames, step_counts: f64) -> bool {
    let elements = frames.elements;
    let whole_of = |element: usize| {
        let mut readings: Vec<f64> =
            frames.counts.iter().skip(element).step_by(elements).map(|counts| f64::from(*counts)).collect();
        let middle = readings.len() / 2;
        // One that is surely not at an end of the range.
        let (_, &mut among, _) = readings.select_nth_unstable_by(middle, f64::total_cmp);
        let is_in_step = |reading: &&f64| {
            let rounding = if is_exact(**reading) { 0.0 } else { reading.abs() * f64::from(f32::EPSILON) };
            rounding < ROUNDED_MAX * step_counts && is_whole(**reading - among, step_counts, rounding)
        };
        readings.iter().filter(is_in_step).count()
    };
    let whole: usize = if frames.is_empty() { 0 } else { (0..elements).map(whole_of).sum() };
    step_counts > 0.0 && whole as f64 > 0.99 * frames.counts.len() as f64
}

/// The level of each element without contact, run by run.
fn zeros(frames: &Frames, values: &[f32]) -> Vec<Vec<f64>> {
    let mut begin = 0;
    let mut zeros = Vec::new();
    for (_, end) in &frames.runs {
        let clear: Vec<usize> =
            (begin..*end).filter(|frame| frames.position_mm[*frame][2] > CLEAR_MM).collect();
        let among = if clear.is_empty() { (begin..*end).collect() } else { clear };
        let level = |element: usize| {
            let of = |frame: &usize| f64::from(values[frame * frames.elements + element]);
            among.iter().map(of).sum::<f64>() / among.len() as f64
        };
        zeros.push((0..frames.elements).map(level).collect());
        begin = *end;
    }
    zeros
}

impl Autoregression {
    /// The noise that fits a rise of `D` best, given as pairs and `D` for each lag. The errors of `D` are shares of it.
    fn of(rise: &[[f64; 2]]) -> Self {
        let all: f64 = rise.iter().map(|[pairs, _]| pairs).sum();
        let tried = |step: u32| {
            let one = Self { variance: 1.0, phi: f64::from(step) * PHI_STEP };
            let ratios = || {
                let of = |(lag, [pairs, d]): (usize, &[f64; 2])| [*pairs, d / (1.0 - one.at(lag + 1))];
                rise.iter().enumerate().map(of)
            };
            let variance = ratios().map(|[pairs, ratio]| pairs * ratio).sum::<f64>() / all.max(1.0);
            let scatter: f64 = ratios().map(|[pairs, ratio]| pairs * (ratio - variance).powi(2)).sum();
            (scatter / (variance * variance).max(f64::MIN_POSITIVE), Self { variance, ..one })
        };
        let best = (0..PHI_STEPS).map(tried).min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(Self { variance: 0.0, phi: 0.0 }, |(_, best)| best)
    }

    /// Correlation at a lag.
    fn at(self, lag: usize) -> f64 {
        self.phi.powi(i32::try_from(lag).unwrap_or(i32::MAX))
    }
}

impl Differences {
    fn none(elements: usize) -> Self {
        Self { squares: vec![[0.0; LAGS]; elements], pairs: vec![[0.0; LAGS]; elements] }
    }

    fn add(&mut self, other: &Self, times: f64) {
        let sums = self.squares.iter_mut().chain(&mut self.pairs).flatten();
        for (sum, one) in sums.zip(other.squares.iter().chain(&other.pairs).flatten()) {
            *sum += times * one;
        }
    }

    /// The mean of `D` over all lags for each element; that of most elements if it differs little from it.
    fn units(&self, longest: usize) -> Vec<f64> {
        let sum = |of: &[f64; LAGS]| of[..longest].iter().sum::<f64>();
        let sums: Vec<[f64; 2]> =
            self.squares.iter().zip(&self.pairs).map(|(s, p)| [sum(s), sum(p)]).collect();
        let of_seen: Vec<f64> = sums.iter().filter(|[_, pairs]| *pairs > 0.0).map(|[s, p]| s / p).collect();
        let typical = median(&of_seen);
        let means = sums.iter().map(|[sum, pairs]| if *pairs > 0.0 { sum / pairs } else { typical });
        let first: f64 = self.pairs.iter().map(|pairs| pairs[0]).sum();
        let independent = (first / self.pairs.len() as f64 / FRAMES_EACH).max(1.0);
        pooled(&means.collect::<Vec<f64>>(), ALIKE_Z * (2.0 / independent).sqrt())
    }

    /// Pairs and mean `D` of all elements, in their units, for each lag.
    fn rise(&self, units: &[f64], longest: usize) -> Vec<[f64; 2]> {
        let of_lag = |lag: usize| {
            let squares =
                self.squares.iter().zip(units).map(|(of, unit)| of[lag] / unit.max(f64::MIN_POSITIVE));
            let pairs: f64 = self.pairs.iter().map(|of| of[lag]).sum();
            [pairs, squares.sum::<f64>() / pairs.max(1.0)]
        };
        (0..longest).map(of_lag).collect()
    }
}
