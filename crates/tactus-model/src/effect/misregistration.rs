//! `misregistration`: the sensor's true position differs from the registration.
//!
//! ```text
//! p_sensor = (1 + scale_error) Rot(-(rotation + rotation_deg)) S (p_robot - origin - offset)
//!
//!     | 1  tan(squareness_deg) |
//! S = |                        |
//!     | 0           1          |
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `offset_x_mm` | mm | 0 | -5 to 5 | the sensor's origin lies so far from where the registration has it, along the robot's x; may be a table of `x_mm` or `y_mm`, as for a bent guide |
//! | `offset_y_mm` | mm | 0 | -5 to 5 | the same along the robot's y; may be a table, too |
//! | `rotation_deg` | degree | 0 | -45 to 45 | the sensor is turned so far beyond the registration, counter-clockwise |
//! | `scale_error` | - | 0 | -0.2 to 0.2 | the stage moves this share further than it reports |
//! | `squareness_deg` | degree | 0 | -10 to 10 | the stage's y axis leans so far towards its x axis; may be left out |
//!
//! Offset and rotation belong to the registration. Scale and squareness belong to the stage and act about the shifted origin: its
//! steps are longer than it reports, and its y axis leans towards x.
//!
//! # Source
//! The paper's Sec. 2.1: two touches near opposite corners define the registration, which inherits their errors.

use super::{By, Definition, Make, Now, OnMotion, Parameter, TipState};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "misregistration",
    summary: "the transform from robot to sensor is off by a shift, a turn, a scale and a stage that is not square",
    parameters: &[
        Parameter::real("offset_x_mm", 0.0, [-5.0, 5.0]).or_table_of(&[By::X, By::Y]),
        Parameter::real("offset_y_mm", 0.0, [-5.0, 5.0]).or_table_of(&[By::X, By::Y]),
        Parameter::real("rotation_deg", 0.0, [-45.0, 45.0]),
        Parameter::real("scale_error", 0.0, [-0.2, 0.2]),
        Parameter::real("squareness_deg", 0.0, [-10.0, 10.0]).or_neutral(),
    ],
    near_twins: &[
        "surface-tilt",
        "gain-drift",
        "backlash",
        "indenter-tilt",
        "edge-effect",
        "anisotropic-spread",
    ],
    acts_by: &[Covariate::PlaceX, Covariate::PlaceY, Covariate::InElementX, Covariate::InElementY],
    shown_by: &["corners", "element-centres", "grid-sweep"],
    curve: None,
    make: Make::Motion(|values| {
        Box::new(Misregistration {
            offset_mm: [values[0], values[1]],
            rotation_deg: values[2],
            scale_error: values[3],
            lean: values[4].to_radians().tan(),
        })
    }),
};

#[derive(Debug)]
struct Misregistration {
    offset_mm: [f64; 2],
    rotation_deg: f64,
    scale_error: f64,
    /// mm of x a mm of y.
    lean: f64,
}

impl OnMotion for Misregistration {
    fn place(&mut self, _: Now<'_>, tip: &mut TipState) {
        self.displace(tip);
    }
}

impl Misregistration {
    fn displace(&self, tip: &mut TipState) {
        let registration = &mut tip.registration;
        registration.rotation_deg += self.rotation_deg;
        for axis in 0..2 {
            registration.origin_mm[axis] += self.offset_mm[axis];
        }
        let [x, y] = [0, 1].map(|axis| tip.tip_mm[axis] - registration.origin_mm[axis]);
        tip.tip_mm[0] += self.scale_error * x + (1.0 + self.scale_error) * self.lean * y;
        tip.tip_mm[1] += self.scale_error * y;
    }
}

#[cfg(test)]
#[path = "misregistration_tests.rs"]
mod tests;
