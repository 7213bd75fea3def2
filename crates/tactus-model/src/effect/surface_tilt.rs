//! `surface-tilt`: the covering's surface is a sloping plane.
//!
//! ```text
//! depth = surface + slope_x (x - x_c) + slope_y (y - y_c) - z
//! ```
//!
//! `x, y` in the sensor frame, `x_c, y_c` the middle of the active area, where a tilt changes nothing: height is
//! then a matter of `surface-offset` alone.
//!
//! # Source
//! The paper's Sec. 2.1: the surface was measured at a single point and taken to be level.

use super::{Base, Definition, Make, Now, OnMotion, Parameter, Place, Shift};

pub(super) static DEFINITION: Definition = Definition {
    name: "surface-tilt",
    summary: "the surface's height changes linearly over the plane",
    parameters: &[
        Parameter::real("slope_x_mm_per_mm", 0.0, [-0.2, 0.2]),
        Parameter::real("slope_y_mm_per_mm", 0.0, [-0.2, 0.2]),
    ],
    near_twins: &["misregistration", "gain-drift", "indenter-tilt", "edge-effect"],
    shown_by: &["tilt", "element-centres"],
    make: Make::Motion(|values| Box::new(SurfaceTilt { slope_mm_per_mm: [values[0], values[1]] })),
};

#[derive(Debug)]
struct SurfaceTilt {
    slope_mm_per_mm: [f64; 2],
}

impl OnMotion for SurfaceTilt {
    fn place(&mut self, now: Now<'_>, place: &mut Place) {
        for (slope, distance_mm) in self.slope_mm_per_mm.iter().zip(from_middle_mm(now.base, place)) {
            place.surface_mm += slope * distance_mm;
        }
    }

    fn slope(&self, parameter: usize, base: Base<'_>, before: &Place) -> Option<Shift> {
        let depth_mm = *from_middle_mm(base, before).get(parameter)?;
        Some(Shift { depth_mm, ..Shift::default() })
    }
}

/// The tip's distance from the middle of the active area, sensor frame.
fn from_middle_mm(base: Base<'_>, place: &Place) -> [f64; 2] {
    let [[x_min, x_max], [y_min, y_max]] = base.model.array().extent_mm();
    let [x, y] = place.position_mm();
    [x - f64::midpoint(x_min, x_max), y - f64::midpoint(y_min, y_max)]
}

#[cfg(test)]
#[path = "surface_tilt_tests.rs"]
mod tests;
