//! `depth-dependent-spread`: the point spread changes with depth.
//!
//! ```text
//! sigma -> sigma (1 + growth_share depth / thickness)          depth at most the thickness
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `growth_share` | - | 0 | -0.9 to 5 | relative growth of sigma where the depth is the whole thickness; may be a table of `depth_mm` |
//!
//! The volume is conserved: the peak falls as the width grows.
//!
//! Cost: one image.
//!
//! # Source
//! The paper's Sec. 3 and Fig. 5a measure sigma at three depths under each covering and fit all with one line in
//! thickness (Eq. 4); this is the first term that the line leaves out.

use super::{By, Definition, Load, Make, Now, OnCovering, Parameter};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "depth-dependent-spread",
    summary: "the point spread changes with depth",
    parameters: &[Parameter::real("growth_share", 0.0, [-0.9, 5.0]).or_table_of(&[By::Depth])],
    near_twins: &["hardening", "saturation", "quadratic_per_mm"],
    acts_by: &[Covariate::Depth, Covariate::Distance, Covariate::ShareOfLargest],
    shown_by: &["grid-sweep", "ladder", "tilt"],
    curve: None,
    make: Make::Covering(|values| Box::new(DepthDependentSpread { growth_share: values[0] })),
};

#[derive(Debug)]
struct DepthDependentSpread {
    growth_share: f64,
}

impl OnCovering for DepthDependentSpread {
    fn spreads(&self) -> bool {
        true
    }

    fn spread(&self, now: Now<'_>, loads: &mut Vec<Load>) {
        for Load { contact, sigma_mm, .. } in loads {
            let depth_share = (contact.depth_mm / now.base.covering.thickness_mm).clamp(0.0, 1.0);
            *sigma_mm = sigma_mm.map(|sigma_mm| sigma_mm * (1.0 + self.growth_share * depth_share));
        }
    }
}

#[cfg(test)]
#[path = "depth_dependent_spread_tests.rs"]
mod tests;
