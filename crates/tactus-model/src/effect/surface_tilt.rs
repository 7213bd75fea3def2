//! `surface-tilt`: the covering's surface is a sloping plane.
//!
//! ```text
//! depth = surface + slope_x (x - x_c - touched_x) + slope_y (y - y_c - touched_y) - z
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `slope_x_mm_per_mm` | mm/mm | 0 | -0.2 to 0.2 | rise of the surface along the sensor's x; may be a table of `x_mm` or `y_mm`, as for a bowed or twisted surface |
//! | `slope_y_mm_per_mm` | mm/mm | 0 | -0.2 to 0.2 | rise of the surface along the sensor's y; may be a table, too |
//! | `touched_x_mm` | mm | 0 | -50 to 50 | where the surface's height was found: x from the middle of the active area |
//! | `touched_y_mm` | mm | 0 | -50 to 50 | the same in y |
//!
//! `x, y` are in the sensor frame; `x_c, y_c` is the middle of the active area. `touched` is the place, from there, where the
//! surface's height was found: a tilt changes nothing at that place. Only its distance along the slope matters.
//!
//! # Source
//! The paper's Sec. 2.1: the surface was measured at a single point and taken to be level.

use super::{BaseModel, By, Definition, Make, Now, OnMotion, Parameter, TipState};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "surface-tilt",
    summary: "the surface's height changes linearly over the plane",
    parameters: &[
        Parameter::real("slope_x_mm_per_mm", 0.0, [-0.2, 0.2]).or_table_of(&[By::X, By::Y]),
        Parameter::real("slope_y_mm_per_mm", 0.0, [-0.2, 0.2]).or_table_of(&[By::X, By::Y]),
        Parameter::real("touched_x_mm", 0.0, [-50.0, 50.0]),
        Parameter::real("touched_y_mm", 0.0, [-50.0, 50.0]),
    ],
    near_twins: &["misregistration", "gain-drift", "indenter-tilt", "edge-effect"],
    acts_by: &[Covariate::PlaceX, Covariate::PlaceY],
    shown_by: &["tilt", "element-centres"],
    curve: None,
    make: Make::Motion(|values| {
        let (slope_mm_per_mm, touched_mm) = ([values[0], values[1]], [values[2], values[3]]);
        Box::new(SurfaceTilt { slope_mm_per_mm, touched_mm })
    }),
};

#[derive(Debug)]
struct SurfaceTilt {
    slope_mm_per_mm: [f64; 2],
    /// From the middle.
    touched_mm: [f64; 2],
}

impl OnMotion for SurfaceTilt {
    fn place(&mut self, now: Now<'_>, tip: &mut TipState) {
        let from_middle_mm = from_middle_mm(now.base, tip);
        for ((slope, from_mm), touched_mm) in
            self.slope_mm_per_mm.iter().zip(from_middle_mm).zip(self.touched_mm)
        {
            tip.surface_mm += slope * (from_mm - touched_mm);
        }
    }
}

/// The tip's distance from the middle of the active area, sensor frame.
fn from_middle_mm(base: BaseModel<'_>, tip: &TipState) -> [f64; 2] {
    let [[x_min, x_max], [y_min, y_max]] = base.model.array().extent_mm();
    let [x, y] = tip.position_mm();
    [x - f64::midpoint(x_min, x_max), y - f64::midpoint(y_min, y_max)]
}

#[cfg(test)]
#[path = "surface_tilt_tests.rs"]
mod tests;
