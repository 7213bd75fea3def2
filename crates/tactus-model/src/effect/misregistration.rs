//! `misregistration`: the sensor does not lie where the robot's calibration says.
//!
//! ```text
//! p_sensor = (1 + scale_error) Rot(-(rotation + rotation_deg)) (p_robot - origin - offset)
//! ```
//!
//! Shift and turn are those of the registration itself; the scale is the stage's, about the shifted origin.
//!
//! # Source
//! The paper's Sec. 2.1: two touches near opposite corners set the registration, and so carry their errors.

use super::{Base, Definition, Make, Now, OnMotion, Parameter, Place, Shift};

pub(super) static DEFINITION: Definition = Definition {
    name: "misregistration",
    summary: "the transform from robot to sensor is off by a shift, a turn and a scale",
    parameters: &[
        Parameter::real("offset_x_mm", 0.0, [-5.0, 5.0]),
        Parameter::real("offset_y_mm", 0.0, [-5.0, 5.0]),
        Parameter::real("rotation_deg", 0.0, [-45.0, 45.0]),
        Parameter::real("scale_error", 0.0, [-0.2, 0.2]),
    ],
    near_twins: &[
        "surface-tilt",
        "gain-drift",
        "backlash",
        "indenter-tilt",
        "edge-effect",
        "anisotropic-spread",
    ],
    shown_by: &["corners", "element-centres", "grid-sweep"],
    make: Make::Motion(|values| {
        Box::new(Misregistration {
            offset_mm: [values[0], values[1]],
            rotation_deg: values[2],
            scale_error: values[3],
        })
    }),
};

#[derive(Debug)]
struct Misregistration {
    offset_mm: [f64; 2],
    rotation_deg: f64,
    scale_error: f64,
}

impl OnMotion for Misregistration {
    fn place(&mut self, _: Now<'_>, place: &mut Place) {
        self.displace(place);
    }

    fn slope(&self, parameter: usize, _: Base<'_>, before: &Place) -> Option<Shift> {
        let mut place = *before;
        self.displace(&mut place);
        let scale = 1.0 + self.scale_error;
        let (sin, cos) = place.registration.rotation_deg.to_radians().sin_cos();
        let [x, y] = place.position_mm();
        let degree = 1.0_f64.to_radians();
        match parameter {
            0 => Some(Shift { position_mm: [-scale * cos, scale * sin], ..Shift::default() }),
            1 => Some(Shift { position_mm: [-scale * sin, -scale * cos], ..Shift::default() }),
            2 => {
                Some(Shift { position_mm: [degree * y, -degree * x], rotation_deg: -1.0, ..Shift::default() })
            }
            3 => Some(Shift { position_mm: [x / scale, y / scale], ..Shift::default() }),
            _ => None,
        }
    }
}

impl Misregistration {
    fn displace(&self, place: &mut Place) {
        let registration = &mut place.registration;
        registration.rotation_deg += self.rotation_deg;
        for axis in 0..2 {
            registration.origin_mm[axis] += self.offset_mm[axis];
            place.tip_mm[axis] += self.scale_error * (place.tip_mm[axis] - registration.origin_mm[axis]);
        }
    }
}

#[cfg(test)]
#[path = "misregistration_tests.rs"]
mod tests;
