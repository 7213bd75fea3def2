//! `surface-offset`: the height of the covering's surface differs from the one that a touch found.
//!
//! ```text
//! depth = surface + offset - z
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `offset_mm` | mm | 0 | -2 to 2 | the surface stands so much higher than the touch that found it says; may be a table of `time_s`, as for a covering that settles |
//!
//! A negative offset is the same as a threshold of contact.
//!
//! # Source
//! The paper's Sec. 2.1: the surface was measured at a single point and taken to be level.

use super::{By, Definition, Make, Now, OnMotion, Parameter, TipState};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "surface-offset",
    summary: "the covering's surface stands higher or lower than the touch that found it says",
    parameters: &[Parameter::real("offset_mm", 0.0, [-2.0, 2.0]).or_table_of(&[By::Time])],
    near_twins: &["saturation", "hardening", "backlash", "indenter-tilt"],
    acts_by: &[Covariate::Time, Covariate::Depth],
    shown_by: &["corners", "element-centres", "ladder"],
    curve: None,
    make: Make::Motion(|values| Box::new(SurfaceOffset { offset_mm: values[0] })),
};

#[derive(Debug)]
struct SurfaceOffset {
    offset_mm: f64,
}

impl OnMotion for SurfaceOffset {
    fn place(&mut self, _: Now<'_>, tip: &mut TipState) {
        tip.surface_mm += self.offset_mm;
    }
}

#[cfg(test)]
#[path = "surface_offset_tests.rs"]
mod tests;
