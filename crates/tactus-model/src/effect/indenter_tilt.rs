//! `indenter-tilt`: the tool's face is not parallel to the plane.
//!
//! ```text
//! I(u, v) = max(0, depth + tan(tilt_x) u + tan(tilt_y) v)          within the face, at most the thickness
//! ```
//!
//! `u, v` along the tool's own sides (the robot's axes) from the foot of its axis, whose height stays: one edge goes
//! deeper, the other less deep, and while all of the face touches the volume is the same. Acts on tools with a flat
//! face and on meshes; the head of a sphere or a cone stays as it is.
//!
//! No derivative in closed form. Cost: one image, in four to five times its time.
//!
//! # Source
//! A rigid flat punch that is turned about an axis in the plane: K. L. Johnson, *Contact Mechanics* (1985).

use super::{Definition, Make, OnContact, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "indenter-tilt",
    summary: "the tool's face is not parallel to the plane",
    parameters: &[
        Parameter::real("tilt_x_deg", 0.0, [-10.0, 10.0]),
        Parameter::real("tilt_y_deg", 0.0, [-10.0, 10.0]),
    ],
    near_twins: &["misregistration", "surface-tilt", "indenter-size"],
    shown_by: &["element-centres", "grid-sweep"],
    make: Make::Contact(|values| Box::new(IndenterTilt { tilt_deg: [values[0], values[1]] })),
};

#[derive(Debug)]
struct IndenterTilt {
    tilt_deg: [f64; 2],
}

impl OnContact for IndenterTilt {
    fn lean(&self) -> [f64; 2] {
        self.tilt_deg.map(|tilt_deg| tilt_deg.to_radians().tan())
    }
}

#[cfg(test)]
#[path = "indenter_tilt_tests.rs"]
mod tests;
