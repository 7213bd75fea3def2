//! `quantisation`: the converter's steps are coarser than declared, or it leaves out codes.
//!
//! ```text
//! counts -> gap_from           for gap_from < counts < gap_from + gap_low_share gap        before the declared converter
//!           gap_from + gap     for the rest of the gap;                                    gap = gap_counts; 0: no gap
//!        -> step round(counts / step)                                                      0: no step
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `step_counts` | counts | 0 | 0 or more | step of the converter; 0: no steps |
//! | `gap_from_counts` | counts | 0 | any | the code before a gap; may be left out, no fit varies it |
//! | `gap_counts` | counts | 0 | 0 or more | from there to the next code that the converter gives, 0: no gap; may be left out |
//! | `gap_low_share` | - | 1 | 0 to 1 | share of the gap, from below, that is read as the code before it; may be left out |
//!
//! A converter with several gaps is as many effects.
//!
//! # Source
//! A converter with fewer effective bits than its word has; missing codes: IEEE Std 1241-2010, section 4.7.

use super::{Definition, Make, OnReadout, Parameter};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "quantisation",
    summary: "the converter's steps are coarser than declared, or it leaves out codes",
    parameters: &[
        Parameter::real("step_counts", 0.0, [0.0, Parameter::COUNTS_MAX]),
        Parameter::given("gap_from_counts", 0.0, [-Parameter::COUNTS_MAX, Parameter::COUNTS_MAX]),
        Parameter::given("gap_counts", 0.0, [0.0, Parameter::COUNTS_MAX]),
        Parameter::given("gap_low_share", 1.0, [0.0, 1.0]),
    ],
    near_twins: &["noise_rms_counts"],
    acts_by: &[Covariate::Counts],
    shown_by: &["drift", "hold"],
    curve: None,
    make: Make::Readout(|values| {
        Box::new(Quantisation {
            step_counts: values[0],
            gap_from_counts: values[1],
            gap_counts: values[2],
            gap_low_share: values[3],
        })
    }),
};

#[derive(Debug)]
struct Quantisation {
    step_counts: f64,
    gap_from_counts: f64,
    gap_counts: f64,
    gap_low_share: f64,
}

impl OnReadout for Quantisation {
    fn convert(&self, counts: f64) -> f64 {
        let given = self.beside_the_gap(counts);
        if self.step_counts > 0.0 { (given / self.step_counts).round() * self.step_counts } else { given }
    }
}

impl Quantisation {
    fn beside_the_gap(&self, counts: f64) -> f64 {
        let beyond = counts - self.gap_from_counts;
        if beyond <= 0.0 || beyond >= self.gap_counts {
            counts
        } else if beyond < self.gap_low_share * self.gap_counts {
            self.gap_from_counts
        } else {
            self.gap_from_counts + self.gap_counts
        }
    }
}

#[cfg(test)]
#[path = "quantisation_tests.rs"]
mod tests;
