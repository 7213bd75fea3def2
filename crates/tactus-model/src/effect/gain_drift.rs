//! `gain-drift`: the sensitivity of all elements changes with time or temperature.
//!
//! ```text
//! counts -> counts + (counts - baseline) (g(t) + per_k (T - T_0))          t since the start
//! g: straight lines from 0 through gain_01_share .. gain_06_share, duration / 6 apart, or through knots; constant after the last
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `rate_per_k` | 1/K | 0 | -0.1 to 0.1 | relative change of the gain for each kelvin above the first known temperature |
//! | `duration_s` | s | 600 | 1 to 1000000 | from the start to the last knot; `tactus discover` sets it to the length of the data |
//! | `gain_01_share` to `gain_06_share` | - | 0 | -1 to 5 | relative change of the gain at the knots, `duration_s / 6` apart |
//!
//! | knots | unit | range | meaning |
//! |---|---|---|---|
//! | `at_s` | s | above 0 | times since the start |
//! | `gain_share` | - | -1 to 5 | `g` there, in straight lines from 0 at 0 and constant after the last; replaces `duration_s` and `gain_01_share` to `gain_06_share` |
//!
//! The curve starts at 0, since the gain there is the base model's. Least squares leave 10 % of the variance of a random walk.
//! `T_0` is the first known temperature; without one, temperature has no effect.
//!
//! Cost: none.
//!
//! # Source
//! Sensitivity drift of an instrument: A. S. Morris and R. Langari, *Measurement and Instrumentation* (2012),
//! chapter 2. Linear splines: C. de Boor, *A Practical Guide to Splines* (2001), chapter 3.

use super::curve::Curve;
use super::{CurveKind, Definition, FreeCurve, Knots, Make, Now, OnReadout, Parameter, Rises, Values};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "gain-drift",
    summary: "the sensitivity changes with time or temperature",
    parameters: &[
        Parameter::real("rate_per_k", 0.0, [-0.1, 0.1]),
        Parameter::real("duration_s", 600.0, [1.0, 1e6]),
        gain("gain_01_share"),
        gain("gain_02_share"),
        gain("gain_03_share"),
        gain("gain_04_share"),
        gain("gain_05_share"),
        gain("gain_06_share"),
    ],
    near_twins: &["misregistration", "surface-tilt", "softening", "baseline-drift"],
    acts_by: &[Covariate::Time, Covariate::Press, Covariate::Temperature],
    shown_by: &["repeats", "element-centres"],
    curve: Some(FreeCurve {
        at: "at_s",
        of: "gain_share",
        kind: CurveKind::Line,
        range: GAINS,
        rises: Rises::No,
        replaces: &[
            "duration_s",
            "gain_01_share",
            "gain_02_share",
            "gain_03_share",
            "gain_04_share",
            "gain_05_share",
            "gain_06_share",
        ],
        formula: |values, at_s| at_s.iter().map(|t_s| even(values).at(*t_s)).collect(),
    }),
    make: Make::Readout(|values| {
        Box::new(GainDrift {
            rate_per_k: values[0],
            gain: Gain::of(values),
            first_c: None,
            t_s: 0.0,
            warmer_k: 0.0,
            rise_counts: Vec::new(),
        })
    }),
};

/// Least and greatest relative change of the gain.
const GAINS: [f64; 2] = [-1.0, 5.0];

const fn gain(name: &'static str) -> Parameter {
    Parameter::real(name, 0.0, GAINS)
}

/// The curve through the formula's knots.
fn even(values: &[f64]) -> Curve<6> {
    Curve::new(values[1], &values[2..])
}

#[derive(Debug)]
struct GainDrift {
    rate_per_k: f64,
    gain: Gain,
    first_c: Option<f64>,
    /// Of the last moment.
    t_s: f64,
    /// Above the first temperature then.
    warmer_k: f64,
    /// What stood above the baselines then.
    rise_counts: Vec<f64>,
}

/// The gain in time.
#[derive(Debug)]
enum Gain {
    Even(Curve<6>),
    Free(Knots),
}

impl Gain {
    fn of(values: &Values) -> Self {
        values.knots().cloned().map_or_else(|| Self::Even(even(values)), Self::Free)
    }

    fn at(&self, t_s: f64) -> f64 {
        match self {
            Self::Even(curve) => curve.at(t_s),
            Self::Free(knots) => knots.line(t_s),
        }
    }
}

impl OnReadout for GainDrift {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        self.first_c = self.first_c.or(now.temperature_c);
        self.t_s = now.t_s;
        self.warmer_k = now.temperature_c.zip(self.first_c).map_or(0.0, |(now_c, first_c)| now_c - first_c);
        let gain = self.gain.at(self.t_s) + self.rate_per_k * self.warmer_k;
        let baselines = &now.base.model.response().baseline_counts;
        self.rise_counts.clear();
        self.rise_counts.extend(counts.iter().zip(baselines).map(|(count, baseline)| count - baseline));
        for (count, rise) in counts.iter_mut().zip(&self.rise_counts) {
            *count += rise * gain;
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.first_c = None;
    }
}

#[cfg(test)]
#[path = "gain_drift_tests.rs"]
mod tests;
