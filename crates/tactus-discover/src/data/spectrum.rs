//! Lines in the spectrum of the residual, such as interference from the mains.
//!
//! Only frames without contact are used. The presses interrupt them, so slow changes also have lines at the rhythm of the
//! presses. Lines at which this rhythm itself has one are ignored.

use super::frames::Frames;
use super::motion::interval_s;
use crate::numbers::{NORMAL_PER_MEDIAN, median};

/// Least height of a line above the surrounding power, in units of the scatter of that power. The sum over elements with
/// independent noise scatters less.
const STANDS_OUT: f64 = 8.0;
/// Factor over the median of the surrounding power at which the rhythm of the presses has a line. The powers of presses without a rhythm are
/// distributed exponentially: `2^-10` of them exceed so much.
const RHYTHM_STANDS_OUT: f64 = 10.0;
/// Number of frequencies on each side that count as surrounding.
const AROUND: usize = 40;
/// Least number of periods in the data; anything slower is a drift.
const PERIODS_LEAST: f64 = 12.0;
const LINES_MAX: usize = 3;

/// Frequencies of the lines in the residual of the frames without contact, clearest first.
///
/// `residual`: frame by frame, element by element.
pub(crate) fn lines_hz(frames: &Frames, residual: &[f64]) -> Vec<f64> {
    let interval_s = interval_s(frames);
    let elements = frames.elements;
    let mut begin = 0;
    let mut longest = (0, 0);
    for (_, end) in &frames.runs {
        if end - begin > longest.1 - longest.0 {
            longest = (begin, *end);
        }
        begin = *end;
    }
    let (begin, end) = longest;
    if end - begin < 256 {
        return Vec::new();
    }
    let duration_s = frames.t_s[end - 1] - frames.t_s[begin];
    let slot = |frame: usize| -> usize {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative, and no more than frames"
        )]
        let slot = ((frames.t_s[frame] - frames.t_s[begin]) / interval_s).round() as usize;
        slot
    };
    let size = (slot(end - 1) + 1).next_power_of_two().min(1 << 18);
    let idle: Vec<usize> =
        (begin..end).filter(|frame| frames.position_mm[*frame][2] > 0.0 && slot(*frame) < size).collect();
    let spectrum = |values: &[f64]| {
        let mut series = vec![[0.0; 2]; size];
        for (frame, value) in idle.iter().zip(values) {
            series[slot(*frame)][0] = *value;
        }
        transform(&mut series);
        series.truncate(size / 2);
        series.into_iter().map(|[re, im]| re * re + im * im)
    };
    let rhythm: Vec<f64> = spectrum(&vec![1.0; idle.len()]).collect();
    let mut power = vec![0.0; size / 2];
    for element in 0..elements {
        let mut values: Vec<f64> = idle.iter().map(|frame| residual[frame * elements + element]).collect();
        let middle = median(&values);
        for value in &mut values {
            *value -= middle;
        }
        for (power, of_element) in power.iter_mut().zip(spectrum(&values)) {
            *power += of_element;
        }
    }
    let step_hz = 1.0 / (size as f64 * interval_s);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
    let first = ((PERIODS_LEAST / duration_s / step_hz) as usize).max(2);
    let mut lines: Vec<(f64, f64)> = Vec::new();
    for peak in first..power.len().saturating_sub(1) {
        if power[peak] < power[peak - 1] || power[peak] < power[peak + 1] {
            continue;
        }
        let around = peak.saturating_sub(AROUND).max(1)..(peak + AROUND).min(power.len());
        let clearness = clearness(power[peak], &power[around.clone()]);
        let is_rhythm = || {
            let middle = median(&rhythm[around.clone()]);
            rhythm[peak - 1..=peak + 1].iter().any(|one| *one > RHYTHM_STANDS_OUT * middle)
        };
        if clearness > STANDS_OUT && !is_rhythm() {
            // The top of a parabola through the logarithms of three powers.
            let [left, top, right] =
                [power[peak - 1], power[peak], power[peak + 1]].map(|p| p.max(f64::MIN_POSITIVE).ln());
            let bend = left - 2.0 * top + right;
            let shift = if bend < 0.0 { 0.5 * (left - right) / bend } else { 0.0 };
            lines.push((clearness, (peak as f64 + shift) * step_hz));
        }
    }
    lines.sort_by(|a, b| b.0.total_cmp(&a.0));
    lines.into_iter().take(LINES_MAX).map(|(_, hz)| hz).collect()
}

/// Height of a power above the surrounding ones, in units of their scatter.
fn clearness(power: f64, around: &[f64]) -> f64 {
    let middle = median(around);
    let off: Vec<f64> = around.iter().map(|one| (one - middle).abs()).collect();
    (power - middle) / (NORMAL_PER_MEDIAN * median(&off)).max(f64::MIN_POSITIVE)
}

/// The discrete Fourier transform in place; the number of points is a power of two.
///
/// # Source
/// J. W. Cooley and J. W. Tukey, *Math. Comput.* 19 (1965) 297.
pub(crate) fn transform(series: &mut [[f64; 2]]) {
    let count = series.len();
    let bits = count.trailing_zeros();
    for index in 0..count {
        let mirrored = index.reverse_bits() >> (usize::BITS - bits);
        if mirrored > index {
            series.swap(index, mirrored);
        }
    }
    let mut half = 1;
    while half < count {
        let turn = -std::f64::consts::PI / half as f64;
        let factors: Vec<[f64; 2]> =
            (0..half).map(|k| [(turn * k as f64).cos(), (turn * k as f64).sin()]).collect();
        for block in series.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for ((low, high), [cos, sin]) in low.iter_mut().zip(high).zip(&factors) {
                let turned = [high[0] * cos - high[1] * sin, high[0] * sin + high[1] * cos];
                *high = [low[0] - turned[0], low[1] - turned[1]];
                *low = [low[0] + turned[0], low[1] + turned[1]];
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
#[path = "spectrum_tests.rs"]
mod tests;
