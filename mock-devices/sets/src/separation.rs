//! How far physics is from the base model: the best that an oracle could detect.

/// A recalibration reduces an element's gain by at most this share, beyond the loss common to all elements. So it absorbs a tool that
/// is half as wide, but not a dead element.
const GAIN_LOSS_MAX: f64 = 0.5;

/// Separation from the base model, in standard deviations of the noise.
///
/// ```text
/// z = sqrt(sum over frames and elements of (D - a_e - b_e C_e - c S)^2) / sigma
/// ```
///
/// `C` are the counts without physics, `D` what physics adds to them, `S` what a somewhat wider spread adds. Per
/// element, `a_e` and `b_e` are the least-squares offset and gain, `1 + b_e` at least half of their median.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Separation {
    /// After recalibration of gains and baselines (`c = 0`).
    pub z: f64,
    /// After recalibration of the spread too (`c` by least squares). If this is small, the physics looks like another
    /// spread.
    pub z_beyond_spread: f64,
    /// `c`, in units of the step to the wider spread.
    pub spread_steps: f64,
}

impl Separation {
    /// From frames of `elements` counts each, all without noise: without physics, with it, and without it under a wider
    /// spread. `sigma_counts` is [`Noise::effective_rms_counts`](crate::Noise::effective_rms_counts).
    pub fn new(clean: &[f64], with: &[f64], wider: &[f64], elements: usize, sigma_counts: f64) -> Self {
        let mut fits = vec![Moments::default(); elements];
        let rows =
            clean.chunks_exact(elements).zip(with.chunks_exact(elements)).zip(wider.chunks_exact(elements));
        for ((clean, with), wider) in rows {
            for (element, fit) in fits.iter_mut().enumerate() {
                let clean = clean[element];
                fit.add([clean, with[element] - clean, wider[element] - clean]);
            }
        }
        let least = (1.0 - GAIN_LOSS_MAX) * (1.0 + common_gain(&fits)) - 1.0;
        let [change, both, wider]: [f64; 3] = [(CHANGE, CHANGE), (CHANGE, WIDER), (WIDER, WIDER)]
            .map(|(one, other)| fits.iter().map(|fit| fit.rest(one, other, least)).sum());
        let spread_steps = if wider > 0.0 { both / wider } else { 0.0 };
        let [z, z_beyond_spread] =
            [change, change - spread_steps * both].map(|squares| squares.max(0.0).sqrt() / sigma_counts);
        Self { z, z_beyond_spread, spread_steps }
    }
}

const CLEAN: usize = 0;
const CHANGE: usize = 1;
const WIDER: usize = 2;

/// Running second moments about the means (Welford).
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    count: f64,
    means: [f64; 3],
    products: [[f64; 3]; 3],
}

impl Moments {
    fn add(&mut self, values: [f64; 3]) {
        self.count += 1.0;
        let before = self.means;
        for (mean, value) in self.means.iter_mut().zip(values) {
            *mean += (value - *mean) / self.count;
        }
        for (one, products) in self.products.iter_mut().enumerate() {
            for (other, product) in products.iter_mut().enumerate() {
                *product += (values[one] - before[one]) * (values[other] - self.means[other]);
            }
        }
    }

    /// The least-squares gain of one quantity on the clean counts; none where the clean counts are constant.
    fn gain(&self, of: usize) -> Option<f64> {
        let clean = self.products[CLEAN][CLEAN];
        (clean > 0.0).then(|| self.products[CLEAN][of] / clean)
    }

    /// Product of the residuals of two quantities after gain (at least `least`) and offset.
    fn rest(&self, one: usize, other: usize, least: f64) -> f64 {
        let product = self.products[one][other];
        let clean = self.products[CLEAN][CLEAN];
        let (Some(by_one), Some(by_other)) = (self.gain(one), self.gain(other)) else { return product };
        let [by_one, by_other] = [by_one, by_other].map(|gain| gain.max(least));
        let crossed = by_one * self.products[CLEAN][other] + by_other * self.products[CLEAN][one];
        product - crossed + by_one * by_other * clean
    }
}

/// The median change of the elements' gains by physics; the upper one of two medians.
fn common_gain(fits: &[Moments]) -> f64 {
    let mut gains: Vec<f64> = fits.iter().filter_map(|fit| fit.gain(CHANGE)).collect();
    gains.sort_by(f64::total_cmp);
    gains.get(gains.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
#[path = "separation_tests.rs"]
mod tests;
