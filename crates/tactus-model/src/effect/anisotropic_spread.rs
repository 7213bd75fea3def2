//! `anisotropic-spread`: the point spread is wider along one side of the sensor than along the other.
//!
//! ```text
//! sigma_x = sqrt(ratio) sigma          sigma_y = sigma / sqrt(ratio)
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `ratio` | - | 1 | 0.2 to 5 | `sigma_x / sigma_y` |
//!
//! The area of the spread stays the same. The axes are the sensor's, because a Gaussian along other axes is not a product of
//! one along x and one along y.
//!
//! Cost: one image.
//!
//! # Source
//! A sheet that was drawn in one direction, or lies on electrodes that run in one direction: the Gaussian of an orthotropic
//! medium, J. Crank, *The Mathematics of Diffusion* (1975).

use super::{BaseModel, Definition, Load, Make, OnCovering, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "anisotropic-spread",
    summary: "the point spread differs along x and y",
    parameters: &[Parameter::real("ratio", 1.0, [0.2, 5.0])],
    near_twins: &["crosstalk", "indenter-size", "misregistration", "sigma_intercept_mm"],
    shown_by: &["grid-sweep", "element-centres"],
    curve: None,
    make: Make::Covering(|values| Box::new(AnisotropicSpread { ratio: values[0] })),
};

#[derive(Debug)]
struct AnisotropicSpread {
    ratio: f64,
}

impl OnCovering for AnisotropicSpread {
    fn spreads(&self) -> bool {
        true
    }

    fn spread(&self, _: BaseModel<'_>, loads: &mut Vec<Load>) {
        for Load { sigma_mm: [x, y], .. } in loads {
            *x *= self.ratio.sqrt();
            *y /= self.ratio.sqrt();
        }
    }
}

#[cfg(test)]
#[path = "anisotropic_spread_tests.rs"]
mod tests;
