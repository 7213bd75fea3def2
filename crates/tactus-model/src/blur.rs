//! The Gaussian point spread along one axis, integrated over an element's side.

use libm::{erfc, exp};
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// A Gaussian of standard deviation `sigma_mm` along one axis, of unit area.
///
/// In two dimensions the spread is the product of one along x and one along y.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Blur {
    /// Positive.
    pub(crate) sigma_mm: f64,
}

impl Blur {
    /// Share of what presses at `at_mm` that arrives within `side_mm = [least, greatest]`; in `[0, 1]`.
    ///
    /// `Phi((greatest - at) / sigma) - Phi((least - at) / sigma)`
    ///
    /// Written as what arrives without blur (all or nothing) plus the tails that the blur adds or takes
    /// away: these keep their relative accuracy far from the element.
    pub(crate) fn of_point(self, at_mm: f64, [least, greatest]: [f64; 2]) -> f64 {
        let inside = least < at_mm && at_mm <= greatest;
        let tail = |edge_mm: f64| {
            let z = (edge_mm - at_mm) / self.sigma_mm;
            -z.signum() * upper_tail(z.abs())
        };
        f64::from(inside) + tail(greatest) - tail(least)
    }

    /// Length in mm of the `line_mm = [from, to]` that arrives within `side_mm = [least, greatest]`: the
    /// integral of [`Blur::of_point`] along the line.
    ///
    /// With `E(z) = z Phi(z) + phi(z)`, the integral of `Phi`, it is the second difference of `sigma E`
    /// over the four distances between an end and an edge. `E(z) = max(z, 0) + T(|z|)`; the second
    /// difference of the first part is the overlap of line and side, which is all there is without blur.
    pub(crate) fn of_line(self, [from, to]: [f64; 2], [least, greatest]: [f64; 2]) -> f64 {
        let overlap_mm = (to.min(greatest) - from.max(least)).max(0.0);
        let tail = |edge_mm: f64, end_mm: f64| {
            let z = ((edge_mm - end_mm) / self.sigma_mm).abs();
            density(z) - z * upper_tail(z)
        };
        let tails = tail(greatest, from) - tail(greatest, to) - tail(least, from) + tail(least, to);
        overlap_mm + self.sigma_mm * tails
    }
}

/// `1 - Phi(z)` of the standard normal distribution.
fn upper_tail(z: f64) -> f64 {
    0.5 * erfc(z * FRAC_1_SQRT_2)
}

/// `phi(z)` of the standard normal distribution.
fn density(z: f64) -> f64 {
    exp(-0.5 * z * z) / (2.0 * PI).sqrt()
}

#[cfg(test)]
#[path = "blur_tests.rs"]
mod tests;
