//! `hardening`: the covering answers more than in proportion to depth.
//!
//! ```text
//! u_e -> u_e (1 + cubic depth^2)          depth in mm, at most the covering's thickness
//! ```
//!
//! The covering is compressed, and so hardens, under the tool; what arrives there is spread as before. So all
//! elements gain by the same factor, whereas the base model's quadratic term acts on each element's own signal.
//!
//! # Source
//! The paper's Sec. 6: at large deformation the response grows nonlinearly by elastic hardening. The first odd term
//! of an elastic law, as in a Duffing spring.

use super::{Base, Definition, Make, Now, OnCovering, Parameter};
use crate::Contact;

pub(super) static DEFINITION: Definition = Definition {
    name: "hardening",
    summary: "the response grows faster than depth",
    parameters: &[Parameter::real("cubic_per_mm2", 0.0, [-1.0, 10.0])],
    near_twins: &["saturation", "surface-offset", "depth-dependent-spread", "quadratic_per_mm"],
    shown_by: &["ladder", "element-centres"],
    make: Make::Covering(|values| Box::new(Hardening { cubic_per_mm2: values[0] })),
};

#[derive(Debug)]
struct Hardening {
    cubic_per_mm2: f64,
}

impl OnCovering for Hardening {
    fn signal(&mut self, now: Now<'_>, contact: &Contact, signal_mm: &mut [f64]) {
        let factor = 1.0 + self.cubic_per_mm2 * depth_mm(now.base, contact).powi(2);
        for u in signal_mm {
            *u *= factor;
        }
    }

    fn slope(
        &self,
        parameter: usize,
        base: Base<'_>,
        contact: &Contact,
        before_mm: &[f64],
        slope_mm: &mut [f64],
    ) -> bool {
        if parameter != 0 {
            return false;
        }
        let depth_mm2 = depth_mm(base, contact).powi(2);
        for (slope, u) in slope_mm.iter_mut().zip(before_mm) {
            *slope = u * depth_mm2;
        }
        true
    }
}

fn depth_mm(base: Base<'_>, contact: &Contact) -> f64 {
    contact.depth_mm.min(base.covering.thickness_mm).max(0.0)
}

#[cfg(test)]
#[path = "hardening_tests.rs"]
mod tests;
