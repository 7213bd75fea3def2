//! `low-pass`: the readout follows with a first-order lag.
//!
//! ```text
//! c' = (counts - c) / time_constant          settled at the first moment
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `time_constant_s` | s | 0 | 0 to 10 | time constant of the filter; at 0 it follows at once |
//!
//! # Source
//! The first-order filter of a charge amplifier or of the controller's averaging.

use super::lag::Lags;
use super::{Definition, Make, Now, OnReadout, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "low-pass",
    summary: "the readout is slow",
    parameters: &[Parameter::real("time_constant_s", 0.0, [0.0, 10.0])],
    near_twins: &["time-lag", "relaxation", "scan-skew", "rate-stiffening", "imprint"],
    shown_by: &["rates", "ladder"],
    curve: None,
    make: Make::Readout(|values| Box::new(LowPass { lag: Lags::new([(values[0], 1.0)]) })),
};

#[derive(Debug)]
struct LowPass {
    lag: Lags,
}

impl OnReadout for LowPass {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        if self.lag.has_begun() {
            self.lag.follow(now.dt_s, counts);
        } else {
            self.lag.begin(counts, counts);
        }
        counts.copy_from_slice(self.lag.output());
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.lag.reset();
    }
}

#[cfg(test)]
#[path = "low_pass_tests.rs"]
mod tests;
