//! The Gaussian point spread along one axis, integrated over an element's side.

use libm::{erfc, exp};
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// A Gaussian of standard deviation `sigma_mm` along one axis, of unit area.
///
/// In two dimensions the spread is the product of one along x and one along y.
#[derive(Debug, Clone, Copy)]
pub struct Blur {
    /// Standard deviation, positive.
    pub sigma_mm: f64,
}

impl Blur {
    /// Share of a load at `at_mm` that arrives within `side_mm = [least, greatest]`; in `[0, 1]`.
    ///
    /// `Phi((greatest - at) / sigma) - Phi((least - at) / sigma)`
    ///
    /// Computed as the value without blur (0 or 1) plus the tails that the blur adds or removes, which keep their relative
    /// accuracy far from the element.
    pub fn of_point(self, at_mm: f64, [least, greatest]: [f64; 2]) -> f64 {
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
    pub fn of_line(self, [from, to]: [f64; 2], [least, greatest]: [f64; 2]) -> f64 {
        let overlap_mm = (to.min(greatest) - from.max(least)).max(0.0);
        let tail = |edge_mm: f64, end_mm: f64| {
            let z = ((edge_mm - end_mm) / self.sigma_mm).abs();
            density(z) - z * upper_tail(z)
        };
        let tails = tail(greatest, from) - tail(greatest, to) - tail(least, from) + tail(least, to);
        overlap_mm + self.sigma_mm * tails
    }

    /// First moment about 0 of what [`Blur::of_line`] counts, in mm^2: the integral of `y` times
    /// [`Blur::of_point`] along the line.
    ///
    /// By parts, with `F(z) = ((z^2 + 1) Phi(z) + z phi(z)) / 2`, the integral of `E`: the difference of
    /// `-sigma y E - sigma^2 F` over the same four distances, again as what is there without blur plus tails.
    pub(crate) fn moment_of_line(self, [from, to]: [f64; 2], [least, greatest]: [f64; 2]) -> f64 {
        let (low, high) = (from.max(least), to.min(greatest));
        let overlap_mm2 = if high > low { (high * high - low * low) / 2.0 } else { 0.0 };
        let rest = |edge_mm: f64, end_mm: f64| {
            let z = (edge_mm - end_mm) / self.sigma_mm;
            let beyond = z.abs();
            let (density, tail) = (density(beyond), upper_tail(beyond));
            let once = density - beyond * tail;
            let twice = ((beyond * beyond + 1.0) * tail - beyond * density) / 2.0;
            let step = if z > 0.0 { 0.5 - twice } else { twice };
            -self.sigma_mm * (end_mm * once + self.sigma_mm * step)
        };
        overlap_mm2 + rest(greatest, to) - rest(greatest, from) - rest(least, to) + rest(least, from)
    }

    /// The integral of [`Blur::of_point`] over all places up to `at_mm`, in mm, and the integral of that, in mm^2:
    ///
    /// `sigma (E((at - least) / sigma) - E((at - greatest) / sigma))`, and the same of `sigma^2 F`; `E` and `F` as of
    /// [`Blur::of_line`] and [`Blur::moment_of_line`].
    pub(crate) fn up_to(self, at_mm: f64, [least, greatest]: [f64; 2]) -> [f64; 2] {
        let [[once, twice], [once_beyond, twice_beyond]] = [least, greatest].map(|edge_mm| {
            let z = (at_mm - edge_mm) / self.sigma_mm;
            let (density, below) = (density(z), upper_tail(-z));
            [z * below + density, f64::midpoint((z * z + 1.0) * below, z * density)]
        });
        [self.sigma_mm * (once - once_beyond), self.sigma_mm * self.sigma_mm * (twice - twice_beyond)]
    }

    /// [`Blur::of_point`] and its first four derivatives by the point's place.
    pub(crate) fn slopes_of_point(self, at_mm: f64, side_mm: [f64; 2]) -> [f64; 5] {
        let [from, to] = side_mm.map(|edge_mm| {
            let z = (at_mm - edge_mm) / self.sigma_mm;
            [1.0, -z, z * z - 1.0, (3.0 - z * z) * z].map(|part| part * density(z))
        });
        let slope = |order: i32| {
            let place = usize::try_from(order - 1).unwrap_or(0);
            (from[place] - to[place]) * self.sigma_mm.powi(-order)
        };
        [self.of_point(at_mm, side_mm), slope(1), slope(2), slope(3), slope(4)]
    }

    /// Derivatives of [`Blur::of_point`] by the point's place and by `sigma_mm`, in 1/mm.
    pub(crate) fn slope_of_point(self, at_mm: f64, side_mm: [f64; 2]) -> [f64; 2] {
        let [least, greatest] = side_mm.map(|edge_mm| (edge_mm - at_mm) / self.sigma_mm);
        let by_place = density(least) - density(greatest);
        let by_sigma = least * density(least) - greatest * density(greatest);
        [by_place / self.sigma_mm, by_sigma / self.sigma_mm]
    }

    /// Derivatives of [`Blur::of_line`] by a shift of the line and by `sigma_mm`, both without unit.
    pub(crate) fn slope_of_line(self, [from, to]: [f64; 2], side_mm: [f64; 2]) -> [f64; 2] {
        let by_shift = self.of_point(to, side_mm) - self.of_point(from, side_mm);
        let between = |end_mm: f64| {
            let [least, greatest] = side_mm.map(|edge_mm| density((edge_mm - end_mm) / self.sigma_mm));
            greatest - least
        };
        [by_shift, between(from) - between(to)]
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
