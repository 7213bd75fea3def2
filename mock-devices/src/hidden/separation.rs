//! How far physics lies from the base model: what an oracle could tell.

/// A recalibration takes no more than this share off an element's gain: a dead element is no matter of calibration.
const GAIN_LOSS_MAX: f64 = 0.5;

/// Separation in standard deviations of the noise.
///
/// ```text
/// z = sqrt(sum over frames and elements of (D - a_e - b_e C_e)^2) / sigma
/// ```
///
/// `C` are the counts without physics, `D` what physics adds to them; per element, `a_e` and `b_e` are the
/// least-squares offset and gain that recalibration takes up, `b_e >= -0.5`. A change of the spread that
/// recalibration would take up too stays in.
///
/// `clean`, `with`: rows of `elements` counts each. `sigma_counts`: of the noise, as it counts in a mean.
pub fn separation(clean: &[f64], with: &[f64], elements: usize, sigma_counts: f64) -> f64 {
    let mut fits = vec![Moments::default(); elements];
    for (clean, with) in clean.chunks_exact(elements).zip(with.chunks_exact(elements)) {
        for ((fit, clean), with) in fits.iter_mut().zip(clean).zip(with) {
            fit.add(*clean, with - clean);
        }
    }
    fits.iter().map(Moments::rest).sum::<f64>().max(0.0).sqrt() / sigma_counts
}

/// Running second moments about the means (Welford).
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    count: f64,
    means: [f64; 2],
    clean_clean: f64,
    clean_change: f64,
    change_change: f64,
}

impl Moments {
    fn add(&mut self, clean: f64, change: f64) {
        self.count += 1.0;
        let [dx, dy] = [clean - self.means[0], change - self.means[1]];
        self.means[0] += dx / self.count;
        self.means[1] += dy / self.count;
        self.clean_clean += dx * (clean - self.means[0]);
        self.clean_change += dx * (change - self.means[1]);
        self.change_change += dy * (change - self.means[1]);
    }

    /// What gain and offset leave of the change.
    fn rest(&self) -> f64 {
        if self.clean_clean <= 0.0 {
            return self.change_change;
        }
        let gain = (self.clean_change / self.clean_clean).max(-GAIN_LOSS_MAX);
        (self.change_change - 2.0 * gain * self.clean_change + gain * gain * self.clean_clean).max(0.0)
    }
}

#[cfg(test)]
#[path = "separation_tests.rs"]
mod tests;
