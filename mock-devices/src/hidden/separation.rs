//! How far physics lies from the base model: what an oracle could tell.

/// A recalibration takes no more than this share off an element's gain: a dead element is no matter of calibration.
const GAIN_LOSS_MAX: f64 = 0.5;

/// Separation from the base model, in standard deviations of the noise.
///
/// ```text
/// z = sqrt(sum over frames and elements of (D - a_e - b_e C_e - c S)^2) / sigma
/// ```
///
/// `C` are the counts without physics, `D` what physics adds to them, `S` what a somewhat wider spread adds. Per
/// element, `a_e` and `b_e >= -0.5` are the least-squares offset and gain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Separation {
    /// After gains and baselines were recalibrated (`c = 0`).
    pub z: f64,
    /// After the spread was recalibrated too (`c` by least squares): where this is small, physics looks like another
    /// spread.
    pub z_beyond_spread: f64,
}

impl Separation {
    /// Of rows of `elements` counts each, all without noise: without physics, with it, and without it under a wider
    /// spread. `sigma_counts` is the noise's, as it counts in a mean.
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
        let [change, both, wider]: [f64; 3] = [(CHANGE, CHANGE), (CHANGE, WIDER), (WIDER, WIDER)]
            .map(|(one, other)| fits.iter().map(|fit| fit.rest(one, other)).sum());
        let taken = if wider > 0.0 { both * both / wider } else { 0.0 };
        let [z, z_beyond_spread] =
            [change, change - taken].map(|squares| squares.max(0.0).sqrt() / sigma_counts);
        Self { z, z_beyond_spread }
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

    /// Product of what gain and offset leave of two.
    fn rest(&self, one: usize, other: usize) -> f64 {
        let product = self.products[one][other];
        let clean = self.products[CLEAN][CLEAN];
        if clean <= 0.0 {
            return product;
        }
        let gain = |of: usize| (self.products[CLEAN][of] / clean).max(-GAIN_LOSS_MAX);
        let [by_one, by_other] = [gain(one), gain(other)];
        let crossed = by_one * self.products[CLEAN][other] + by_other * self.products[CLEAN][one];
        product - crossed + by_one * by_other * clean
    }
}

#[cfg(test)]
#[path = "separation_tests.rs"]
mod tests;
