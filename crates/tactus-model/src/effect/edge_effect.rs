//! `edge-effect`: the covering's response differs near its edge, or near the seam between two sensors.
//!
//! ```text
//! u_e -> u_e (1 + edge_share exp(-edge distance / reach) + seam_share exp(-seam distance / reach))
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `edge_share` | - | 0 | -1 to 2 | relative change of the signal where the tool's axis is at the edge |
//! | `seam_share` | - | 0 | -1 to 2 | relative change of the signal where the tool's axis is at the seam |
//! | `reach_mm` | mm | 2 | 0.1 to 20 | distance over which either change falls to 1/e |
//!
//! The distances are those of the tool's axis: from the nearest side of the active area (0 on it and outside), and from
//! the line in the middle of x, where the paper's two sensors meet. A factor that depends on the element's own place would be
//! part of its sensitivity.
//!
//! Cost: none.
//!
//! # Source
//! The paper's Fig. 1: two sensors side by side. The disturbance of an edge dies away exponentially within about a
//! thickness, by Saint-Venant's principle: S. P. Timoshenko and J. N. Goodier, *Theory of Elasticity* (1970).

use super::{BaseModel, Definition, Make, Now, OnCovering, Parameter};
use crate::Contact;

pub(super) static DEFINITION: Definition = Definition {
    name: "edge-effect",
    summary: "the response changes near the covering's edge or the seam between the sensors",
    parameters: &[
        Parameter::real("edge_share", 0.0, [-1.0, 2.0]),
        Parameter::real("seam_share", 0.0, [-1.0, 2.0]),
        Parameter::real("reach_mm", 2.0, [0.1, 20.0]),
    ],
    near_twins: &["surface-tilt", "misregistration", "sensitivity_counts_per_mm"],
    shown_by: &["element-centres", "tilt", "corners"],
    curve: None,
    make: Make::Covering(|values| {
        Box::new(EdgeEffect { shares: [values[0], values[1]], reach_mm: values[2] })
    }),
};

#[derive(Debug)]
struct EdgeEffect {
    /// Of the edge and of the seam.
    shares: [f64; 2],
    reach_mm: f64,
}

impl OnCovering for EdgeEffect {
    fn signal(&mut self, now: Now<'_>, contact: &Contact, signal_mm: &mut [f64]) {
        let nearness = self.nearness(now.base, contact);
        let added: f64 = self.shares.iter().zip(nearness).map(|(share, nearness)| share * nearness).sum();
        for u in signal_mm {
            *u *= 1.0 + added;
        }
    }
}

impl EdgeEffect {
    /// 1 at the edge and at the seam, less further off.
    fn nearness(&self, base: BaseModel<'_>, contact: &Contact) -> [f64; 2] {
        distances_mm(base, contact).map(|distance_mm| (-distance_mm / self.reach_mm).exp())
    }
}

/// Of the tool's axis from the edge and from the seam.
fn distances_mm(base: BaseModel<'_>, contact: &Contact) -> [f64; 2] {
    let [[x_min, x_max], [y_min, y_max]] = base.model.array().extent_mm();
    let [x, y] = contact.position_mm;
    let edge_mm = (x - x_min).min(x_max - x).min(y - y_min).min(y_max - y);
    [edge_mm.max(0.0), (x - f64::midpoint(x_min, x_max)).abs()]
}

#[cfg(test)]
#[path = "edge_effect_tests.rs"]
mod tests;
