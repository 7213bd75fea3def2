//! `time-lag`: frames are late or early relative to the stage's positions.
//!
//! ```text
//! tip(t) -> tip(t - lag)          late: lag > 0
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `lag_s` | s | 0 | -1 to 1 | a frame shows where the tip was so long before; negative: frames are early |
//!
//! The path is looked up at another instant. A negative lag needs a path that knows its future. Where positions arrive one by
//! one, a [`Trail`](crate::Trail) of them is the path.
//!
//! Cost: none.
//!
//! # Source
//! Transport delay, the factor `exp(-s lag)` of a linear system: K. J. Astrom and R. M. Murray, *Feedback Systems*
//! (2008).

use super::{Definition, Make, OnMotion, Parameter};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "time-lag",
    summary: "frames are late or early against the stage's positions",
    parameters: &[Parameter::real("lag_s", 0.0, [-1.0, 1.0])],
    near_twins: &["low-pass", "relaxation", "scan-skew", "backlash", "hysteresis", "rate-stiffening"],
    acts_by: &[
        Covariate::SinceTurn,
        Covariate::Speed,
        Covariate::TravelSpeed,
        Covariate::Direction,
        Covariate::Ahead,
    ],
    shown_by: &["rates", "ladder"],
    curve: None,
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

    fn is_timed(&self) -> bool {
        true
    }
}

#[cfg(test)]
#[path = "time_lag_tests.rs"]
mod tests;
