//! First-order lags of a list of values, exact for inputs that are straight between moments.

/// `q' = (u - q) / tau` for every value, and the derivative of `q` by `tau`.
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
    by_tau: Vec<f64>,
}

impl Lag {
    /// With a time constant that is not negative; 0 follows at once.
    pub(super) fn new(tau_s: f64) -> Self {
        Self { tau_s, before: Vec::new(), output: Vec::new(), by_tau: Vec::new() }
    }

    /// True once there is a past.
    pub(super) fn has_begun(&self) -> bool {
        !self.output.is_empty()
    }

    /// Begins with an output; the input so far was `input`.
    pub(super) fn begin(&mut self, output: &[f64], input: &[f64]) {
        self.output = output.to_vec();
        self.before = input.to_vec();
        self.by_tau = vec![0.0; output.len()];
    }

    /// Goes on to `input`, reached `dt_s` after the last; at once (a jump) if that is 0.
    pub(super) fn follow(&mut self, dt_s: f64, input: &[f64]) {
        if self.tau_s == 0.0 {
            self.output.copy_from_slice(input);
            // A small lag subtracts tau times the input's rise.
            for ((by_tau, u0), u1) in self.by_tau.iter_mut().zip(&self.before).zip(input) {
                *by_tau = if dt_s > 0.0 { (u0 - u1) / dt_s } else { 0.0 };
            }
        } else if dt_s > 0.0 {
            let x = dt_s / self.tau_s;
            let keeps = (-x).exp();
            let mean = -(-x).exp_m1() / x;
            for (((q, by_tau), u0), u1) in
                self.output.iter_mut().zip(&mut self.by_tau).zip(&self.before).zip(input)
            {
                // d E / d tau = E x / tau; d phi / d tau = (phi - E) / tau.
                let by_share = (keeps * x * (*q - u0) + (mean - keeps) * (u0 - u1)) / self.tau_s;
                *by_tau = keeps * *by_tau + by_share;
                *q = keeps * *q + (mean - keeps) * u0 + (1.0 - mean) * u1;
            }
        }
        self.before.copy_from_slice(input);
    }

    /// What has followed.
    pub(super) fn output(&self) -> &[f64] {
        &self.output
    }

    /// Its derivative by the time constant, per s.
    pub(super) fn by_tau(&self) -> &[f64] {
        &self.by_tau
    }

    /// Forgets the past.
    pub(super) fn reset(&mut self) {
        *self = Self::new(self.tau_s);
    }
}

/// The mean of three lags, on a scale of ratios: of `tau / ratio`, `tau` and `tau ratio`.
#[derive(Debug)]
pub(super) struct SpreadLag {
    ratio: f64,
    lags: [Lag; 3],
}

impl SpreadLag {
    /// With a time constant that is not negative, and a ratio of at least 1, at which all three are one.
    pub(super) fn new(tau_s: f64, ratio: f64) -> Self {
        Self { ratio, lags: spread(tau_s, ratio).map(Lag::new) }
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

    /// Its derivative by the time constant, per s.
    pub(super) fn by_tau(&self, index: usize) -> f64 {
        let [short, middle, long] = self.by_each(index);
        mean([short / self.ratio, middle, long * self.ratio])
    }

    /// Its derivative by the ratio.
    pub(super) fn by_ratio(&self, index: usize) -> f64 {
        let ([short, _, long], tau_s) = (self.by_each(index), self.lags[1].tau_s);
        mean([-short * tau_s / self.ratio.powi(2), 0.0, long * tau_s])
    }

    /// As [`Lag::reset`].
    pub(super) fn reset(&mut self) {
        self.lags.iter_mut().for_each(Lag::reset);
    }

    fn by_each(&self, index: usize) -> [f64; 3] {
        self.lags.each_ref().map(|lag| lag.by_tau[index])
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
