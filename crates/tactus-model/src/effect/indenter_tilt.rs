//! `indenter-tilt`: the tool's face is not parallel to the plane.
//!
//! ```text
//! I(u, v) = max(0, depth - touched_share lowest + tan(tilt_x) u + tan(tilt_y) v)   within the face, at most the thickness
//! lowest  = the greatest tan(tilt_x) u + tan(tilt_y) v of the face
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `tilt_x_deg` | degree | 0 | -10 to 10 | tilt along the tool's own x; positive: the side of positive x is deeper; may be a table of `x_mm` or `y_mm`, as for an arm that bends with its reach |
//! | `tilt_y_deg` | degree | 0 | -10 to 10 | the same along the tool's own y; may be a table, too |
//! | `touched_share` | - | 0.5 | 0 to 1 | the point to which depth is measured: 0 the foot of the axis, 1 the lowest point |
//!
//! `u, v` run along the tool's own sides (the robot's axes) from the foot of its axis. With a `touched_share` of 0 one edge is
//! deeper and the other less deep; the volume is the same as long as the whole face touches. With 1 the depth is that of the
//! lowest point, which finds the surface in a touch. The effect acts on tools with a flat face and on meshes, not on spheres and
//! cones.
//!
//! Cost: one image, in four to five times its time.
//!
//! # Source
//! A rigid flat punch that is turned about an axis in the plane: K. L. Johnson, *Contact Mechanics* (1985).

use super::{By, Definition, Make, Now, OnContact, Parameter};
use crate::Contact;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "indenter-tilt",
    summary: "the tool's face is not parallel to the plane",
    parameters: &[
        Parameter::real("tilt_x_deg", 0.0, [-10.0, 10.0]).or_table_of(&[By::X, By::Y]),
        Parameter::real("tilt_y_deg", 0.0, [-10.0, 10.0]).or_table_of(&[By::X, By::Y]),
        Parameter::real("touched_share", 0.5, [0.0, 1.0]),
    ],
    near_twins: &["misregistration", "surface-offset", "surface-tilt", "indenter-size"],
    acts_by: &[Covariate::Distance, Covariate::Depth, Covariate::PlaceX, Covariate::PlaceY],
    shown_by: &["element-centres", "grid-sweep"],
    curve: None,
    make: Make::Contact(|values| {
        Box::new(IndenterTilt { tilt_deg: [values[0], values[1]], touched_share: values[2] })
    }),
};

#[derive(Debug)]
struct IndenterTilt {
    tilt_deg: [f64; 2],
    touched_share: f64,
}

impl OnContact for IndenterTilt {
    fn touch(&self, now: Now<'_>, contact: &mut Contact) {
        contact.depth_mm -= self.touched_share * contact.indenter.lowered_mm(self.lean(now, contact));
    }

    fn lean(&self, _: Now<'_>, _: &Contact) -> [f64; 2] {
        self.tilt_deg.map(|tilt_deg| tilt_deg.to_radians().tan())
    }
}

#[cfg(test)]
#[path = "indenter_tilt_tests.rs"]
mod tests;
