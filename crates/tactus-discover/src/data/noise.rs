//! The noise of readings, from frames that repeat each other.
//!
//! Where the tip has rested for a while, readings differ by noise only. With a reading `x(t)`,
//!
//! ```text
//! D(k) = mean (x(t + k) - x(t))^2 / 2 = noise^2 (1 - rho(k))
//! ```
//!
//! The plateau of `D` is the variance of a reading, and the rise of `D` gives the autocorrelation `rho`. Slow changes such
//! as drift hardly contribute to a difference over a second. None of this depends on the model.
//!
//! Where no rest is long enough for the plateau, [`stretches`] fits the rise of `D` in short ones. Where the tip never rests
//! for some frames, [`repeats`] compares presses with the same command.

mod repeats;
mod stretches;

use std::f64::consts::PI;

use super::floor::Floor;
use super::frames::Frames;
use super::motion::stride;
use crate::numbers::median;

/// The tip is at rest if it was still for this time.
const SETTLED_S: f64 = 1.0;
/// Lags of the plateau, in strides: about a second.
const PLATEAU: std::ops::RangeInclusive<usize> = 20..=30;
/// With strides of several frames, `D` has levelled off if it rises by no more than this factor along the plateau. That of first-order autoregressive
/// noise whose correlation falls to `1 / e` there, as short dwells must show it too, rises by `(1 - 1 / e) / (1 - e^(-2 / 3))`.
const LEVELLED: f64 = 1.3;
/// Elements whose noise differs by fewer standard errors are taken to have the same noise.
const ALIKE_Z: f64 = 3.0;
/// Least number of pairs of frames for an estimate.
const PAIRS_LEAST: usize = 20;
/// Least number of degrees of freedom of a floor: with 10, the standard error of the noise is 22 %.
const FREEDOM_LEAST: f64 = 10.0;
/// Share of the degrees of freedom in differences of neighbours, beside independent readings of as many pairs (J. von Neumann
/// et al., *Ann. Math. Stat.* 12 (1941) 153).
const DIFFERENCES_SHARE: f64 = 2.0 / 3.0;

/// The noise of an element counts as at least this share of the typical noise. A single element that is quieter than most cannot
/// be distinguished from rounding.
pub(crate) const QUIETEST: f64 = 0.7;

/// Median absolute value of a standard normal deviate.
const MEDIAN_SIZE: f64 = 0.674_490;

/// Where rounding that repeats is this share of the noise, nothing dithers.
const ALL_ROUNDING: f64 = 0.9;

/// Statistics of the noise of readings.
#[derive(Debug, Clone)]
pub(crate) struct Noise {
    /// Standard deviation of one reading: the median over the elements.
    pub(crate) rms_counts: f64,
    /// Standard deviation of one reading of each element.
    pub(crate) by_element_counts: Vec<f64>,
    /// Autocorrelation at lags of 0, 1, ... frames.
    pub(crate) correlation: Vec<f64>,
    /// Share of a reading's variance that comes from rounding and repeats for the same signal, so averaging does not reduce it. From a quarter of a step
    /// of noise on it is right; below, where the variance at rest lacks what repeats, to a factor of three.
    pub(crate) rounding_share: f64,
    /// For how many readings a signal repeats, in the mean over the readings in contact: where the tip rests.
    pub(crate) repeated_frames: f64,
}

impl Noise {
    /// Whether a mean square of residuals, in units of the noise, may come from rounding alone. Where nothing dithers, a signal at rest is read as
    /// the same code for all the recording: a reading is wrong by up to half a step, and so is the zero under it.
    pub(crate) fn may_be_rounding(&self, mean_square: f64) -> bool {
        self.rounding_share > ALL_ROUNDING && mean_square < 2.0
    }

    /// Whether so much of a mean square of residuals, in units of the noise, may be what repeats of rounding: in a reading, and in the zero under it.
    pub(crate) fn may_repeat(&self, mean_square: f64) -> bool {
        mean_square < 2.0 * self.rounding_share
    }

    /// The noise with the best floor that the data have. Without a floor, the noise serves as weights only.
    pub(crate) fn measured(frames: &Frames, still: &[usize], step_counts: f64) -> (Self, Floor) {
        if let Some((noise, freedom)) = Self::in_time(frames, &frames.counts, still, step_counts) {
            let rms_counts = noise.rms_counts;
            return (noise, Floor::Time { rms_counts, freedom });
        }
        if let Some((noise, freedom)) = repeats::noise(frames, still, step_counts) {
            let rms_counts = noise.rms_counts;
            return (noise, Floor::Repeats { rms_counts, freedom });
        }
        (Self::of_differences(frames, step_counts), Floor::None)
    }

    /// The noise from repeats in time of counts or of a model's residual, frame by frame, element by element, and its degrees
    /// of freedom. `None` if the tip rests too rarely or too briefly.
    pub(crate) fn in_time(
        frames: &Frames,
        values: &[f32],
        still: &[usize],
        step_counts: f64,
    ) -> Option<(Self, f64)> {
        let found = Self::of(frames, values, still, step_counts)
            .or_else(|| stretches::noise(frames, values, still, step_counts));
        found.filter(|(_, freedom)| *freedom >= FREEDOM_LEAST)
    }

    /// The noise from rests that reach the plateau, and its degrees of freedom. `None` if there are none.
    pub(crate) fn of(
        frames: &Frames,
        values: &[f32],
        still: &[usize],
        step_counts: f64,
    ) -> Option<(Self, f64)> {
        let elements = frames.elements;
        let stride = stride(frames);
        // Every lag up to that of the plateau's end in strides, and whole strides from there on.
        let short = 1..=*PLATEAU.end();
        let long = short.clone().map(|lag| lag * stride).filter(|lag| lag > PLATEAU.end());
        let lags: Vec<usize> = short.chain(long).collect();
        let mut squares = vec![0.0_f64; lags.len() * elements];
        let mut pairs = vec![0_usize; lags.len()];
        let settled = settled(frames, still);
        for (place, lag) in lags.iter().copied().enumerate() {
            for frame in lag..frames.len() {
                if still[frame] < lag || !settled[frame - lag] {
                    continue;
                }
                pairs[place] += 1;
                let of = |frame: usize| &values[frame * elements..(frame + 1) * elements];
                let (now, then) = (of(frame), of(frame - lag));
                for ((sum, now), then) in squares[place * elements..].iter_mut().zip(now).zip(then) {
                    *sum += f64::from(now - then).powi(2) / 2.0;
                }
            }
        }
        // Places of the lags of the plateau that have enough pairs.
        let is_far = |place: &usize| lags[*place] >= PLATEAU.start() * stride;
        let longest = (0..lags.len()).filter(is_far).rfind(|place| pairs[*place] >= PAIRS_LEAST)?;
        let first = (0..lags.len()).find(is_far)?;
        let plateau = first..=longest;
        // The variance of rounding of a uniform distribution.
        let rounding = step_counts * step_counts / 12.0;
        let variance = |element: usize| {
            let (sum, count) = plateau.clone().fold((0.0, 0), |(sum, count), place| {
                (sum + squares[place * elements + element], count + pairs[place])
            });
            (sum / count as f64).max(rounding).max(f64::MIN_POSITIVE)
        };
        let variances: Vec<f64> = (0..elements).map(variance).collect();
        // `D` at a lag, as a share of the variance.
        let risen = |place: usize| {
            let share = |e: usize| squares[place * elements + e] / pairs[place] as f64 / variances[e];
            median(&(0..elements).map(share).collect::<Vec<_>>())
        };
        if stride > 1 && risen(longest) > LEVELLED * risen(first) {
            return None;
        }
        let at_lags = (0..lags.len()).map(|place| match pairs[place] {
            ..PAIRS_LEAST => 0.0,
            _ => (1.0 - risen(place)).clamp(0.0, 1.0),
        });
        let correlation = at_each(&lags, &at_lags.collect::<Vec<f64>>());
        let independent = pairs[longest] as f64 / memory_frames(&correlation) as f64;
        let variances = pooled(&variances, ALIKE_Z * (2.0 / independent).sqrt());
        let typical = median(&variances);
        let rounding_share = bias_variance(typical - rounding, step_counts) / typical;
        let noise = Self {
            rms_counts: typical.sqrt(),
            by_element_counts: variances.iter().map(|variance| variance.sqrt()).collect(),
            correlation,
            rounding_share,
            repeated_frames: repeated_frames(frames, still),
        };
        let readings = DIFFERENCES_SHARE * (pairs[longest] * elements) as f64;
        let freedom = readings / noise.squares_inflation(pairs[longest]);
        Some((noise, freedom))
    }

    /// From differences of consecutive frames, for the weights of data in which nothing repeats. Fast signals contribute too, and
    /// autocorrelated noise looks smaller than it is, so this is no floor.
    pub(crate) fn of_differences(frames: &Frames, step_counts: f64) -> Self {
        let elements = frames.elements;
        let rms = |element: usize| {
            // x1 - 2 x2 + x3 removes straight lines and has six times the variance.
            let bend = |frame: usize| {
                let [a, b, c] = [frame - 2, frame - 1, frame].map(|one| frames.counts_of(one)[element]);
                f64::from(a - 2.0 * b + c).abs()
            };
            let bends: Vec<f64> = (2..frames.len()).map(bend).collect();
            let variance = (median_in_steps(&bends, step_counts) / MEDIAN_SIZE).powi(2) / 6.0;
            variance.max(step_counts * step_counts / 12.0).max(f64::MIN_POSITIVE).sqrt()
        };
        let by_element_counts: Vec<f64> = (0..elements).map(rms).collect();
        Self {
            rms_counts: median(&by_element_counts),
            by_element_counts,
            correlation: vec![1.0],
            rounding_share: 0.0,
            repeated_frames: 1.0,
        }
    }

    /// By how much the variance of a mean of `frames` consecutive readings exceeds that of independent ones. Rounding repeats for as long
    /// as the signal does.
    pub(crate) fn inflation(&self, frames: usize) -> f64 {
        let count = frames as f64;
        let pairs = self.correlation.iter().enumerate().skip(1).take(frames.saturating_sub(1));
        let correlated = 1.0 + 2.0 * pairs.map(|(lag, rho)| (1.0 - lag as f64 / count) * rho).sum::<f64>();
        correlated + (count.min(self.repeated_frames) - 1.0).max(0.0) * self.rounding_share
    }

    /// By how much the variance of a sum of squares of readings exceeds that of independent ones. This takes the noise to be
    /// first-order autoregressive: means of `frames` readings have the inflation `(1 + phi) / (1 - phi)`, sums of squares
    /// have `(1 + phi^2) / (1 - phi^2)`.
    pub(crate) fn squares_inflation(&self, frames: usize) -> f64 {
        let inflation = self.inflation(frames);
        let phi = ((inflation - 1.0) / (inflation + 1.0)).clamp(0.0, 0.98);
        (1.0 + phi * phi) / (1.0 - phi * phi)
    }

    /// Correlation of two readings that are `lag` frames apart, without what rounding adds.
    pub(crate) fn correlation_at(&self, lag: usize) -> f64 {
        self.correlation.get(lag).copied().unwrap_or(0.0)
    }

    /// Number of frames after which readings are independent.
    pub(crate) fn memory_frames(&self) -> usize {
        memory_frames(&self.correlation)
    }
}

/// The number of frames of the rest to which a frame in contact belongs, in the mean over such frames; 1 while the tip moves. In the clear an
/// element's signal does not change at all, and its baseline takes up what rounding does to it.
pub(super) fn repeated_frames(frames: &Frames, still: &[usize]) -> f64 {
    let (mut readings, mut squares) = (0.0, 0.0);
    for (frame, before) in still.iter().enumerate() {
        let is_last = still.get(frame + 1).is_none_or(|next| *next == 0);
        if is_last && frames.position_mm[frame][2] < 0.0 {
            let rest = (before + 1) as f64;
            readings += rest;
            squares += rest * rest;
        }
    }
    if readings > 0.0 { squares / readings } else { 1.0 }
}

/// A correlation at each lag from 0 on, straight between the lags at which it is known, which rise.
fn at_each(lags: &[usize], known: &[f64]) -> Vec<f64> {
    let mut all = vec![1.0];
    for (lag, value) in lags.iter().zip(known) {
        let (from, before) = (all.len() - 1, all[all.len() - 1]);
        let between = |between: usize| {
            let share = (between - from) as f64 / (lag - from) as f64;
            before + share * (value - before)
        };
        all.extend((from + 1..*lag).map(between));
        all.push(*value);
    }
    all
}

fn memory_frames(correlation: &[f64]) -> usize {
    correlation.iter().rposition(|rho| *rho > 0.1).unwrap_or(0) + 1
}

/// Replaces variances that differ by no more than this share by their mean. Weights from chance differences would make some
/// elements look quiet, and their residuals look like more than noise.
fn pooled(variances: &[f64], share: f64) -> Vec<f64> {
    let middle = median(variances);
    let is_alike = |variance: f64| variance < middle * (1.0 + share) && variance * (1.0 + share) > middle;
    let alike: Vec<f64> = variances.iter().copied().filter(|variance| is_alike(*variance)).collect();
    let mean = alike.iter().sum::<f64>() / alike.len().max(1) as f64;
    variances.iter().map(|variance| if is_alike(*variance) { mean } else { *variance }).collect()
}

/// Variance of the bias that rounding to a step gives the mean of a signal under normal noise, over signals anywhere in the
/// step. It vanishes if the noise dithers; without noise it is the variance of rounding itself.
///
/// # Source
/// B. Widrow and I. Kollar, *Quantization Noise* (2008), ch. 9, of a signal `x` under noise of a standard deviation `s`:
///
/// ```text
/// E[error] = step / pi sum_k (-1)^k / k exp(-2 pi^2 k^2 s^2 / step^2) sin(2 pi k x / step)
/// ```
///
/// squared and averaged over `x`.
fn bias_variance(noise_variance: f64, step_counts: f64) -> f64 {
    let square = (step_counts * step_counts).max(f64::MIN_POSITIVE);
    let term = |k: i32| {
        let k_square = f64::from(k * k);
        (-4.0 * PI * PI * k_square * noise_variance.max(0.0) / square).exp() / k_square
    };
    square / (2.0 * PI * PI) * (1..=400).map(term).sum::<f64>()
}

/// Whether the tip was at rest for [`SETTLED_S`], for every frame.
fn settled(frames: &Frames, still: &[usize]) -> Vec<bool> {
    (0..frames.len()).map(|frame| frames.t_s[frame] - frames.t_s[frame - still[frame]] >= SETTLED_S).collect()
}

/// The median of absolute values that come in steps, interpolated within its step to avoid an error of up to half a step.
fn median_in_steps(sizes: &[f64], step: f64) -> f64 {
    let middle = median(sizes);
    let [least, most] = [(middle - step / 2.0).max(0.0), middle + step / 2.0];
    let below = sizes.iter().filter(|size| **size < least).count() as f64;
    let within = sizes.iter().filter(|size| (least..most).contains(*size)).count() as f64;
    if within > 0.0 { least + (most - least) * (sizes.len() as f64 / 2.0 - below) / within } else { middle }
}

#[cfg(test)]
#[path = "noise_tests.rs"]
mod tests;
