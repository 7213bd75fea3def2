//! `baseline-drift`: the baseline changes in time, for all elements together or for one.
//!
//! ```text
//! counts -> counts + c(t - start)          t since the start of the run
//! c: straight lines from 0 through offset_01_counts .. offset_16_counts, duration / 16 apart; constant before and after
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `element` | index | -1 | -1, or an element of the array | the element that drifts; -1, or left out: all of them, alike |
//! | `start_s` | s | 0 | 0 to 1000000 | start of the curve; no fit varies it; may be left out |
//! | `duration_s` | s | 600 | 1 to 1000000 | from the start to the last knot; `tactus discover` sets it to the length of the data |
//! | `offset_01_counts` to `offset_16_counts` | counts | 0 | any | drift at the knots, `duration_s / 16` apart |
//!
//! The curve starts at 0, since the baselines belong to the base model. It follows a drift of any shape: a trend, a warm-up, a
//! random walk. Least squares leave 4 % of the variance of a random walk; 12 knots would leave 5 % and 6 knots 10 %. A drift
//! that is faster than a sixteenth of the duration takes several effects, each starting where the one before ends. Elements
//! that drift independently need one effect each.
//!
//! Cost: none.
//!
//! # Source
//! Linear splines: C. de Boor, *A Practical Guide to Splines* (2001), chapter 3. Zero drift of an instrument: A. S.
//! Morris and R. Langari, *Measurement and Instrumentation* (2012), chapter 2.

use super::curve::Curve;
use super::{Definition, Make, Now, OnReadout, Parameter};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "baseline-drift",
    summary: "the baseline drifts in time",
    parameters: &[
        Parameter::element_or_all("element"),
        Parameter::given("start_s", 0.0, [0.0, 1e6]),
        Parameter::real("duration_s", 600.0, [1.0, 1e6]),
        Parameter::counts("offset_01_counts"),
        Parameter::counts("offset_02_counts"),
        Parameter::counts("offset_03_counts"),
        Parameter::counts("offset_04_counts"),
        Parameter::counts("offset_05_counts"),
        Parameter::counts("offset_06_counts"),
        Parameter::counts("offset_07_counts"),
        Parameter::counts("offset_08_counts"),
        Parameter::counts("offset_09_counts"),
        Parameter::counts("offset_10_counts"),
        Parameter::counts("offset_11_counts"),
        Parameter::counts("offset_12_counts"),
        Parameter::counts("offset_13_counts"),
        Parameter::counts("offset_14_counts"),
        Parameter::counts("offset_15_counts"),
        Parameter::counts("offset_16_counts"),
    ],
    near_twins: &["imprint", "relaxation", "gain-drift", "periodic-interference"],
    acts_by: &[Covariate::Time, Covariate::Press, Covariate::Temperature],
    shown_by: &["drift"],
    curve: None,
    make: Make::Readout(|values| {
        Box::new(BaselineDrift {
            element: element(values[0]),
            start_s: values[1],
            zero_counts: Curve::new(values[2], &values[3..]),
            t_s: 0.0,
        })
    }),
};

#[derive(Debug)]
struct BaselineDrift {
    /// `None` for all.
    element: Option<usize>,
    start_s: f64,
    zero_counts: Curve<16>,
    /// Of the last moment, since the start.
    t_s: f64,
}

impl BaselineDrift {
    /// Those of all elements' counts that it acts on.
    fn own<'a>(&self, counts: &'a mut [f64]) -> &'a mut [f64] {
        match self.element {
            None => counts,
            Some(element) => counts.get_mut(element..=element).unwrap_or_default(),
        }
    }
}

impl OnReadout for BaselineDrift {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        self.t_s = now.t_s - self.start_s;
        let drift_counts = self.zero_counts.at(self.t_s);
        for count in self.own(counts) {
            *count += drift_counts;
        }
    }

    fn is_timed(&self) -> bool {
        true
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an index, checked against the array"
)]
fn element(value: f64) -> Option<usize> {
    (value >= 0.0).then_some(value as usize)
}

#[cfg(test)]
#[path = "baseline_drift_tests.rs"]
mod tests;
