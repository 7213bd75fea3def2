//! `saturation`: the response levels off at the top.
//!
//! ```text
//! u_e -> c tanh(u_e / c)          1 / c^2 = inverse_square_ceiling
//! ```
//!
//! Small signals are as they were, large ones end at the ceiling `c`, before the element's gain and baseline. The
//! converter's own end, which is sudden, is the base model's. The first term is `-u_e^3 / (3 c^2)`, in proportion to
//! the parameter, so that a fit can start from none.
//!
//! Derivative in closed form. Cost: a hyperbolic tangent for each element.
//!
//! # Source
//! The transfer of a bipolar differential pair: P. R. Gray and R. G. Meyer, *Analysis and Design of Analog Integrated
//! Circuits*, chapter 3.

use super::{Base, Definition, Make, OnElement, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "saturation",
    summary: "the response levels off at the top",
    parameters: &[Parameter::real("inverse_square_ceiling_per_mm2", 0.0, [0.0, 100.0])],
    near_twins: &["hardening", "surface-offset", "depth-dependent-spread", "quadratic_per_mm"],
    shown_by: &["ladder", "element-centres"],
    make: Make::Element(|values| Box::new(Saturation { inverse_ceiling_per_mm: values[0].sqrt() })),
};

#[derive(Debug)]
struct Saturation {
    inverse_ceiling_per_mm: f64,
}

impl OnElement for Saturation {
    fn signal(&self, _: Base<'_>, _: &[f64], signal_mm: &mut [f64]) {
        if self.inverse_ceiling_per_mm > 0.0 {
            for u in signal_mm {
                *u = (self.inverse_ceiling_per_mm * *u).tanh() / self.inverse_ceiling_per_mm;
            }
        }
    }

    fn slope(
        &self,
        parameter: usize,
        _: Base<'_>,
        _: &[f64],
        before_mm: &[f64],
        slope_mm: &mut [f64],
    ) -> bool {
        if parameter != 0 {
            return false;
        }
        for (slope, u) in slope_mm.iter_mut().zip(before_mm) {
            *slope = u.powi(3) * bend(self.inverse_ceiling_per_mm * u);
        }
        true
    }
}

/// Derivative of `tanh(x) / x` by `x^2`.
fn bend(x: f64) -> f64 {
    if x.abs() < 0.01 {
        // The difference below has lost its digits: the first terms of its series.
        -1.0 / 3.0 + 4.0 / 15.0 * x * x
    } else {
        (x / x.cosh().powi(2) - x.tanh()) / (2.0 * x.powi(3))
    }
}

#[cfg(test)]
#[path = "saturation_tests.rs"]
mod tests;
