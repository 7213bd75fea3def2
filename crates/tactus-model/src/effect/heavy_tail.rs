//! `heavy-tail`: the point spread has more weight far out than a Gaussian.
//!
//! ```text
//! G -> (1 - tail_share) G_sigma + tail_share G_(width_ratio sigma)
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `tail_share` | - | 0 | 0 to 1 | share of the volume that is in the wider Gaussian |
//! | `width_ratio` | - | 2 | 1 to 10 | standard deviation of the wider Gaussian over that of the core |
//!
//! Both Gaussians have unit volume. The tail lowers the peak, so that the sensitivity, which is stated for one Gaussian, must be
//! calibrated again.
//!
//! # Source
//! The layered elastic solution falls off more slowly than the Gaussian of its core (the paper's Fig. 3); a mixture
//! of two Gaussians is the usual closed form of such a spread.

use super::{Definition, Load, Make, Now, OnCovering, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "heavy-tail",
    summary: "the point spread has more weight far out than a Gaussian",
    parameters: &[
        Parameter::real("tail_share", 0.0, [0.0, 1.0]),
        Parameter::real("width_ratio", 2.0, [1.0, 10.0]),
    ],
    near_twins: &["crosstalk", "sigma_intercept_mm"],
    shown_by: &["grid-sweep", "element-centres"],
    curve: None,
    make: Make::Covering(|values| Box::new(HeavyTail { tail_share: values[0], width_ratio: values[1] })),
};

#[derive(Debug)]
struct HeavyTail {
    tail_share: f64,
    width_ratio: f64,
}

impl OnCovering for HeavyTail {
    fn spreads(&self) -> bool {
        true
    }

    fn spread(&self, _: Now<'_>, loads: &mut Vec<Load>) {
        if self.tail_share == 0.0 {
            return;
        }
        let tail = |core: &Load| Load {
            weight: self.tail_share * core.weight,
            sigma_mm: core.sigma_mm.map(|sigma_mm| self.width_ratio * sigma_mm),
            ..core.clone()
        };
        let tails: Vec<Load> = loads.iter().map(tail).collect();
        for core in loads.iter_mut() {
            core.weight *= 1.0 - self.tail_share;
        }
        loads.extend(tails);
    }
}

#[cfg(test)]
#[path = "heavy_tail_tests.rs"]
mod tests;
