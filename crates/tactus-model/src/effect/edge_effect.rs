//! `edge-effect`: the covering's response differs near its edge, or near the seam between two sensors.
//!
//! ```text
//! u_e -> u_e (1 + sum over places of share exp(-distance / reach))
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `edge_share` | - | 0 | -1 to 2 | relative change of the signal where the tool's axis is at the edge |
//! | `seam_share` | - | 0 | -1 to 2 | relative change of the signal where the tool's axis is at the seam |
//! | `reach_mm` | mm | 2 | 0.1 to 20 | distance over which each change falls to 1/e |
//! | `x_min_share` | - | 0 | -1 to 2 | as `edge_share`, at the side of the least x alone; may be left out |
//! | `x_max_share` | - | 0 | -1 to 2 | the same at the side of the greatest x |
//! | `y_min_share` | - | 0 | -1 to 2 | the same at the side of the least y |
//! | `y_max_share` | - | 0 | -1 to 2 | the same at the side of the greatest y |
//! | `corner_share` | - | 0 | -1 to 2 | the same at the nearest corner; its distance is the sum of those from its two sides |
//!
//! The distances are those of the tool's axis: from the nearest side of the active area (0 on it and outside), and from
//! the line in the middle of x, where the paper's two sensors meet. A covering may be glued down along one side only, or cut round at its
//! corners, so that each side and the corners have shares of their own. A factor that depends on the element's own place would be
//! part of its sensitivity.
//!
//! Cost: none.
//!
//! # Source
//! The paper's Fig. 1: two sensors side by side. The disturbance of an edge dies away exponentially within about a
//! thickness, by Saint-Venant's principle: S. P. Timoshenko and J. N. Goodier, *Theory of Elasticity* (1970).

use super::{BaseModel, Definition, Make, Now, OnCovering, Parameter};
use crate::Contact;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "edge-effect",
    summary: "the response changes near the covering's edge or the seam between the sensors",
    parameters: &[
        Parameter::real("edge_share", 0.0, [-1.0, 2.0]),
        Parameter::real("seam_share", 0.0, [-1.0, 2.0]),
        Parameter::real("reach_mm", 2.0, [0.1, 20.0]),
        Parameter::real("x_min_share", 0.0, [-1.0, 2.0]).apart(),
        Parameter::real("x_max_share", 0.0, [-1.0, 2.0]).apart(),
        Parameter::real("y_min_share", 0.0, [-1.0, 2.0]).apart(),
        Parameter::real("y_max_share", 0.0, [-1.0, 2.0]).apart(),
        Parameter::real("corner_share", 0.0, [-1.0, 2.0]).apart(),
    ],
    near_twins: &["surface-tilt", "misregistration", "sensitivity_counts_per_mm"],
    acts_by: &[Covariate::PlaceX, Covariate::PlaceY],
    shown_by: &["element-centres", "tilt", "corners"],
    curve: None,
    make: Make::Covering(|values| {
        let shares = [values[0], values[1], values[3], values[4], values[5], values[6], values[7]];
        Box::new(EdgeEffect { shares, reach_mm: values[2] })
    }),
};

#[derive(Debug)]
struct EdgeEffect {
    /// Of the edge, the seam, each side and the corners.
    shares: [f64; PLACES],
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
    /// 1 at each of the places, less further off.
    fn nearness(&self, base: BaseModel<'_>, contact: &Contact) -> [f64; PLACES] {
        distances_mm(base, contact).map(|distance_mm| (-distance_mm / self.reach_mm).exp())
    }
}

/// Number of the places near which the response differs.
const PLACES: usize = 7;

/// Of the tool's axis from the edge, the seam, each side and the nearest corner.
fn distances_mm(base: BaseModel<'_>, contact: &Contact) -> [f64; PLACES] {
    let [[x_min, x_max], [y_min, y_max]] = base.model.array().extent_mm();
    let [x, y] = contact.position_mm;
    let sides_mm = [x - x_min, x_max - x, y - y_min, y_max - y].map(|side_mm| side_mm.max(0.0));
    let [left_mm, right_mm, low_mm, high_mm] = sides_mm;
    // Near along both sides: the product of the two nearnesses.
    let corner_mm = left_mm.min(right_mm) + low_mm.min(high_mm);
    let edge_mm = sides_mm.into_iter().fold(f64::INFINITY, f64::min);
    let seam_mm = (x - f64::midpoint(x_min, x_max)).abs();
    [edge_mm, seam_mm, left_mm, right_mm, low_mm, high_mm, corner_mm]
}

#[cfg(test)]
#[path = "edge_effect_tests.rs"]
mod tests;
