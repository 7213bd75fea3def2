//! First-order lags of a list of values, exact for inputs that are straight between moments.

/// A weighted sum of lags of every value: of each, `q' = (u - q) / tau`.
///
/// With `x = dt / tau`, `E = exp(-x)` and `phi = (1 - E) / x`, an input that runs straight from `u0` to `u1` gives
///
/// ```text
/// q1 = E q0 + (phi - E) u0 + (1 - phi) u1
/// ```
///
/// an average of the three: more moments on the same line change nothing but rounding.
#[derive(Debug)]
pub(super) struct Lags {
    parts: Vec<Lag>,
    before: Vec<f64>,
    sum: Vec<f64>,
}

#[derive(Debug)]
struct Lag {
    tau_s: f64,
    weight: f64,
    output: Vec<f64>,
}

impl Lags {
    /// With time constants that are not negative, 0 following at once, and the weight of each. What has no weight costs nothing.
    pub(super) fn new(of: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let lag = |(tau_s, weight)| (weight != 0.0).then_some(Lag { tau_s, weight, output: Vec::new() });
        Self { parts: of.into_iter().filter_map(lag).collect(), before: Vec::new(), sum: Vec::new() }
    }

    /// True once there is a past.
    pub(super) fn has_begun(&self) -> bool {
        !self.before.is_empty()
    }

    /// Begins with an output of each lag; the input so far was `input`.
    pub(super) fn begin(&mut self, output: &[f64], input: &[f64]) {
        let weights: f64 = self.parts.iter().map(|lag| lag.weight).sum();
        self.parts.iter_mut().for_each(|lag| lag.output = output.to_vec());
        self.sum = output.iter().map(|output| weights * output).collect();
        self.before = input.to_vec();
    }

    /// Goes on to `input`, reached `dt_s` after the last; at once (a jump) if that is 0.
    pub(super) fn follow(&mut self, dt_s: f64, input: &[f64]) {
        self.sum.fill(0.0);
        for lag in &mut self.parts {
            let [keeps, of_before, of_input] = lag.shares(dt_s);
            let inputs = self.before.iter().zip(input);
            for ((q, sum), (u0, u1)) in lag.output.iter_mut().zip(&mut self.sum).zip(inputs) {
                *q = keeps * *q + of_before * u0 + of_input * u1;
                *sum += lag.weight * *q;
            }
        }
        self.before.copy_from_slice(input);
    }

    /// The sum of what has followed.
    pub(super) fn output(&self) -> &[f64] {
        &self.sum
    }

    /// Forgets the past.
    pub(super) fn reset(&mut self) {
        self.parts.iter_mut().for_each(|lag| lag.output.clear());
        self.before.clear();
        self.sum.clear();
    }
}

impl Lag {
    /// Shares of the output, of the input before and of the input now in the output that follows.
    fn shares(&self, dt_s: f64) -> [f64; 3] {
        if self.tau_s == 0.0 {
            return [0.0, 0.0, 1.0];
        }
        if dt_s <= 0.0 {
            return [1.0, 0.0, 0.0];
        }
        let x = dt_s / self.tau_s;
        let lost = -(-x).exp_m1();
        let (keeps, mean) = (1.0 - lost, lost / x);
        [keeps, mean - keeps, 1.0 - mean]
    }
}

/// Three times on a scale of ratios.
pub(super) fn spread(time_s: f64, ratio: f64) -> [f64; 3] {
    [time_s / ratio, time_s, time_s * ratio]
}

#[cfg(test)]
#[path = "lag_tests.rs"]
mod tests;
