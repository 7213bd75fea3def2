//! First-order lags of a list of values, exact for inputs that are straight between moments.

/// `q' = (u - q) / tau` for every value.
///
/// With `x = dt / tau`, `E = exp(-x)` and `phi = (1 - E) / x`, an input that runs straight from `u0` to `u1` gives
///
/// ```text
/// q1 = E q0 + (phi - E) u0 + (1 - phi) u1
/// ```
///
/// an average of the three: more moments on the same line change nothing but rounding.
#[derive(Debug)]
pub(super) struct Lag {
    tau_s: f64,
    before: Vec<f64>,
    output: Vec<f64>,
}

impl Lag {
    /// With a time constant that is not negative; 0 follows at once.
    pub(super) fn new(tau_s: f64) -> Self {
        Self { tau_s, before: Vec::new(), output: Vec::new() }
    }

    /// True once there is a past.
    pub(super) fn has_begun(&self) -> bool {
        !self.output.is_empty()
    }

    /// Begins with an output; the input so far was `input`.
    pub(super) fn begin(&mut self, output: &[f64], input: &[f64]) {
        self.output = output.to_vec();
        self.before = input.to_vec();
    }

    /// Goes on to `input`, reached `dt_s` after the last; at once (a jump) if that is 0.
    pub(super) fn follow(&mut self, dt_s: f64, input: &[f64]) {
        if self.tau_s == 0.0 {
            self.output.copy_from_slice(input);
        } else if dt_s > 0.0 {
            let x = dt_s / self.tau_s;
            let keeps = (-x).exp();
            let mean = -(-x).exp_m1() / x;
            for ((q, u0), u1) in self.output.iter_mut().zip(&self.before).zip(input) {
                *q = keeps * *q + (mean - keeps) * u0 + (1.0 - mean) * u1;
            }
        }
        self.before.copy_from_slice(input);
    }

    /// What has followed.
    pub(super) fn output(&self) -> &[f64] {
        &self.output
    }

    /// Forgets the past.
    pub(super) fn reset(&mut self) {
        *self = Self::new(self.tau_s);
    }
}

/// The mean of three lags, on a scale of ratios: of `tau / ratio`, `tau` and `tau ratio`.
#[derive(Debug)]
pub(super) struct SpreadLag {
    lags: [Lag; 3],
}

impl SpreadLag {
    /// With a time constant that is not negative, and a ratio of at least 1, at which all three are one.
    pub(super) fn new(tau_s: f64, ratio: f64) -> Self {
        Self { lags: spread(tau_s, ratio).map(Lag::new) }
    }

    /// As [`Lag::has_begun`].
    pub(super) fn has_begun(&self) -> bool {
        self.lags[0].has_begun()
    }

    /// As [`Lag::begin`].
    pub(super) fn begin(&mut self, output: &[f64], input: &[f64]) {
        self.lags.iter_mut().for_each(|lag| lag.begin(output, input));
    }

    /// As [`Lag::follow`].
    pub(super) fn follow(&mut self, dt_s: f64, input: &[f64]) {
        self.lags.iter_mut().for_each(|lag| lag.follow(dt_s, input));
    }

    /// What has followed, of the value of an index.
    pub(super) fn output(&self, index: usize) -> f64 {
        mean(self.lags.each_ref().map(|lag| lag.output[index]))
    }

    /// As [`Lag::reset`].
    pub(super) fn reset(&mut self) {
        self.lags.iter_mut().for_each(Lag::reset);
    }
}

/// Three times on a scale of ratios.
pub(super) fn spread(time_s: f64, ratio: f64) -> [f64; 3] {
    [time_s / ratio, time_s, time_s * ratio]
}

/// Of three values.
pub(super) fn mean(values: [f64; 3]) -> f64 {
    values.iter().sum::<f64>() / 3.0
}

#[cfg(test)]
#[path = "lag_tests.rs"]
mod tests;
