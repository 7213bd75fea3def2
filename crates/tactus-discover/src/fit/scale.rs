//! Scale on which a fit varies a parameter: linear, or logarithmic if the range spans orders of magnitude.
//!
//! What is much or little of a parameter its range says; of a frequency the length of the data, and of counts their own extent.

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

/// How far data reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    /// Duration of the longest run; at least 1 s. It is the resolution of frequencies.
    pub(crate) duration_s: f64,
    /// From the least to the greatest reading of the element that varies most.
    pub(crate) span_counts: f64,
}

/// The scale of one parameter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    range: [f64; 2],
    logarithmic: bool,
    /// Length of the range in the parameter's unit; of counts, of what data of their extent could show.
    pub(crate) reach: f64,
    /// A small step, for derivatives.
    pub(crate) step: f64,
    stride_max: f64,
}

impl Scale {
    /// Scale of a parameter, in data of an extent.
    pub(crate) fn of(parameter: &Parameter, extent: Extent) -> Self {
        let range = parameter.range;
        // Up or down by all that there is.
        let reach = if parameter.is_counts() { 2.0 * extent.span_counts } else { range[1] - range[0] };
        let linear = |step, stride_max| Self { range, logarithmic: false, reach, step, stride_max };
        if parameter.name.ends_with("_hz") {
            let period_hz = 1.0 / extent.duration_s.max(1.0);
            return linear(0.02 * period_hz, 0.3 * period_hz);
        }
        if range[0] > 0.0 && range[1] / range[0] >= ORDERS {
            return Self { range, logarithmic: true, reach, step: LOG_STEP, stride_max: LOG_STRIDE_MAX };
        }
        linear(STEP * reach, STRIDE_MAX * reach)
    }

    /// Width of the range on this scale.
    pub(crate) fn width(&self) -> f64 {
        if self.logarithmic { self.distance(self.range[0], self.range[1]) } else { self.reach }
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
