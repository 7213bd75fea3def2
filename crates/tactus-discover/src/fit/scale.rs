//! Scale on which a fit varies a parameter: linear, or logarithmic if the range spans orders of magnitude.

use tactus_model::effect::Parameter;

/// Least ratio of a range that spans orders of magnitude.
const ORDERS: f64 = 20.0;
/// Step for derivatives on a logarithmic scale.
const LOG_STEP: f64 = 0.02;
/// Step for derivatives on a linear scale, as a share of the range.
const STEP: f64 = 1e-3;
/// Longest step of a fit: in logarithm, or as a share of the range.
const LOG_STRIDE_MAX: f64 = 1.5;
const STRIDE_MAX: f64 = 0.25;

/// The scale of one parameter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    range: [f64; 2],
    logarithmic: bool,
    /// A small step, for derivatives.
    pub(crate) step: f64,
    stride_max: f64,
}

impl Scale {
    /// Scale of a parameter, in data of a given duration, which determines the resolution of frequencies.
    pub(crate) fn of(parameter: &Parameter, duration_s: f64) -> Self {
        let range = parameter.range;
        if parameter.name.ends_with("_hz") {
            let period_hz = 1.0 / duration_s.max(1.0);
            return Self { range, logarithmic: false, step: 0.02 * period_hz, stride_max: 0.3 * period_hz };
        }
        if range[0] > 0.0 && range[1] / range[0] >= ORDERS {
            return Self { range, logarithmic: true, step: LOG_STEP, stride_max: LOG_STRIDE_MAX };
        }
        let width = range[1] - range[0];
        Self { range, logarithmic: false, step: STEP * width, stride_max: STRIDE_MAX * width }
    }

    /// Width of the range on this scale.
    pub(crate) fn width(&self) -> f64 {
        self.distance(self.range[0], self.range[1])
    }

    /// The value after a step, limited to the range.
    pub(crate) fn forward(&self, value: f64, step: f64) -> f64 {
        let moved = if self.logarithmic { value * step.exp() } else { value + step };
        moved.clamp(self.range[0], self.range[1])
    }

    /// The step from one value to another.
    pub(crate) fn distance(&self, from: f64, to: f64) -> f64 {
        if self.logarithmic { (to / from).ln() } else { to - from }
    }

    /// A step limited to the longest that a fit takes.
    pub(crate) fn bounded(&self, step: f64) -> f64 {
        step.clamp(-self.stride_max, self.stride_max)
    }

    /// The longest step that a fit takes: further away, derivatives say nothing.
    pub(crate) const fn stride_max(&self) -> f64 {
        self.stride_max
    }

    /// Error of a value from its error on the scale.
    pub(crate) fn error(&self, value: f64, along: f64) -> f64 {
        if self.logarithmic { value * along } else { along }
    }
}
