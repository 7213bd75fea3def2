//! `time-lag`: frames are late or early relative to the stage's positions.
//!
//! ```text
//! tip(t) -> tip(t - lag)          late: lag > 0
//! ```
//!
//! The effect looks up the path at another instant. Early frames need a path whose future is known. If positions become
//! known one by one, the path is a [`Trail`](crate::Trail).
//!
//! No derivative: it needs the tip's velocity, which only the path knows. Cost: none.
//!
//! # Source
//! Transport delay, the factor `exp(-s lag)` of a linear system: K. J. Astrom and R. M. Murray, *Feedback Systems*
//! (2008).

use super::{Definition, Make, OnMotion, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "time-lag",
    summary: "frames are late or early against the stage's positions",
    parameters: &[Parameter::real("lag_s", 0.0, [-1.0, 1.0])],
    near_twins: &["low-pass", "relaxation", "scan-skew", "backlash", "hysteresis", "rate-stiffening"],
    shown_by: &["rates", "ladder"],
    make: Make::Motion(|values| Box::new(TimeLag { lag_s: values[0] })),
};

#[derive(Debug)]
struct TimeLag {
    lag_s: f64,
}

impl OnMotion for TimeLag {
    fn instant_s(&self, t_s: f64) -> f64 {
        t_s - self.lag_s
    }
}

#[cfg(test)]
#[path = "time_lag_tests.rs"]
mod tests;
