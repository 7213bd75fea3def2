//! `quantisation`: the converter's steps are coarser than declared.
//!
//! ```text
//! counts -> step round(counts / step)          before the declared converter; 0: no step
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `step_counts` | counts | 0 | 0 to 1000 | step of the converter; 0: no steps |
//!
//! # Source
//! A converter with fewer effective bits than its word has.

use super::{Definition, Make, OnReadout, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "quantisation",
    summary: "the converter's steps are coarser than declared",
    parameters: &[Parameter::real("step_counts", 0.0, [0.0, 1000.0])],
    near_twins: &["noise_rms_counts"],
    shown_by: &["drift", "hold"],
    curve: None,
    make: Make::Readout(|values| Box::new(Quantisation { step_counts: values[0] })),
};

#[derive(Debug)]
struct Quantisation {
    step_counts: f64,
}

impl OnReadout for Quantisation {
    fn convert(&self, counts: f64) -> f64 {
        if self.step_counts > 0.0 { (counts / self.step_counts).round() * self.step_counts } else { counts }
    }
}

#[cfg(test)]
#[path = "quantisation_tests.rs"]
mod tests;
