//! `anisotropic-spread`: the point spread is wider along one side of the sensor than along the other.
//!
//! ```text
//! sigma_x = sqrt(ratio) sigma          sigma_y = sigma / sqrt(ratio)
//! covariance of x and y = slant sigma_x sigma_y
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `ratio` | - | 1 | 0.2 to 5 | `sigma_x / sigma_y`; may be a table of `depth_mm`, `x_mm` or `y_mm` |
//! | `slant` | - | 0 | -0.8 to 0.8 | correlation of x and y: the long axis lies between the sensor's; may be left out |
//!
//! The standard deviations along the sensor's sides are as without a slant. A Gaussian along other axes is not a product of one along x and
//! one along y. It is one that is narrower by `sqrt(1 - |slant|)`, smeared along a diagonal by a Gaussian, for which five points stand: up to
//! a slant of 0.3 the spread is right within 0.4 % of its peak.
//!
//! Cost: one image, with a slant five.
//!
//! # Source
//! A sheet that was drawn in one direction, or lies on electrodes that run in one direction: the Gaussian of an orthotropic
//! medium, J. Crank, *The Mathematics of Diffusion* (1975). Five points for a Gaussian: Gauss-Hermite quadrature, M. Abramowitz and I. A.
//! Stegun, *Handbook of Mathematical Functions* (1964), 25.4.46.

use super::{By, Definition, Load, Make, Now, OnCovering, Parameter};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "anisotropic-spread",
    summary: "the point spread differs along x and y",
    parameters: &[
        Parameter::real("ratio", 1.0, [0.2, 5.0]).or_table_of(&[By::Depth, By::X, By::Y]),
        Parameter::real("slant", 0.0, [-0.8, 0.8]).apart(),
    ],
    near_twins: &["crosstalk", "indenter-size", "misregistration", "sigma_intercept_mm"],
    acts_by: &[
        Covariate::Distance,
        Covariate::ShareOfLargest,
        Covariate::Depth,
        Covariate::PlaceX,
        Covariate::PlaceY,
    ],
    shown_by: &["grid-sweep", "element-centres"],
    curve: None,
    make: Make::Covering(|values| Box::new(AnisotropicSpread { ratio: values[0], slant: values[1] })),
};

/// Places, in standard deviations, and weights of five points that have a Gaussian's moments up to the ninth: those of
/// Gauss-Hermite quadrature.
const ALONG: [(f64, f64); 5] = [
    (-2.856_970_013_872_806, 0.011_257_411_327_720_69),
    (-1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (0.0, 0.533_333_333_333_333_3),
    (1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (2.856_970_013_872_806, 0.011_257_411_327_720_69),
];

#[derive(Debug)]
struct AnisotropicSpread {
    ratio: f64,
    slant: f64,
}

impl OnCovering for AnisotropicSpread {
    fn spreads(&self) -> bool {
        true
    }

    fn spread(&self, _: Now<'_>, loads: &mut Vec<Load>) {
        for Load { sigma_mm: [x, y], .. } in loads.iter_mut() {
            *x *= self.ratio.sqrt();
            *y /= self.ratio.sqrt();
        }
        if self.slant != 0.0 {
            *loads = loads.iter().flat_map(|load| self.slanted(load)).collect();
        }
    }
}

impl AnisotropicSpread {
    /// Loads along a diagonal, which together spread like a slanted Gaussian.
    fn slanted(&self, load: &Load) -> [Load; 5] {
        let along = self.slant.abs().sqrt();
        let away_mm = [along * load.sigma_mm[0], along.copysign(self.slant) * load.sigma_mm[1]];
        let across = (1.0 - self.slant.abs()).sqrt();
        ALONG.map(|(place, weight)| {
            let mut one = load.clone();
            one.weight *= weight;
            one.sigma_mm = load.sigma_mm.map(|sigma_mm| across * sigma_mm);
            for (at_mm, away_mm) in one.contact.position_mm.iter_mut().zip(away_mm) {
                *at_mm += place * away_mm;
            }
            one
        })
    }
}

#[cfg(test)]
#[path = "anisotropic_spread_tests.rs"]
mod tests;
