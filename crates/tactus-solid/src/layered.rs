//! The pressure at the base of an elastic layer, by the Hankel transform.
//!
//! A layer of thickness `h` lies on a rigid base. A vertical force of 1 N presses on its top, at a point or evenly
//! over a disc. In the plane's Fourier domain the pressure at the base is the pressure at the top times `T(K)`,
//! with `K = k h` the wave number in units of the thickness. With `kappa = 3 - 4 nu`:
//!
//! ```text
//! bonded         T(K) = 2 (kappa + 1) [(kappa + 1)/2 cosh K + K sinh K] / [2 kappa cosh 2K + 4 K^2 + 1 + kappa^2]
//! frictionless   T(K) = 2 (sinh K + K cosh K) / (sinh 2K + 2 K)
//! p(r)         = 1/(2 pi) integral_0^inf T(k h) D(k) J0(k r) k dk
//! ```
//!
//! `D` is 1 for a point and `2 J1(k a)/(k a)` for a disc of radius `a`. The layer is linear and its strains are
//! small; deep presses into a soft covering are stiffer (paper, Sec. 3).
//!
//! ```
//! use tactus_solid::layered::{BaseContact, Layer};
//!
//! let covering = Layer::new(1.016, 0.45, BaseContact::Bonded)?;
//! let share = covering.under_disc(1.0).force_on([[-0.9, 0.9], [-0.9, 0.9]]);
//! assert!(share > 0.7, "most of the force arrives at the element below");
//! # Ok::<(), tactus_solid::layered::LayerError>(())
//! ```
//!
//! # Source
//! The layer's general solution in Papkovich-Neuber form with the four boundary conditions solved by hand; paper,
//! Sec. 3, for its use as the transfer function of a covering.

use std::f64::consts::PI;

use libm::{exp, expm1, j0, j1};

use crate::{quadrature::integrate, search::peak};

/// `T` falls like `K exp(-K)` and is negligible beyond this `K`.
const WAVES_MAX: f64 = 36.0;
/// Distance from the load, in thicknesses, beyond which the pressure is negligible: it falls like `exp(-0.74 r/h)` in an
/// incompressible layer, and faster in others.
const REACH: f64 = 40.0;

/// An elastic layer on a rigid base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    thickness_mm: f64,
    poisson_ratio: f64,
    base: BaseContact,
}

/// Contact of the layer with its base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BaseContact {
    /// The layer sticks to the base.
    Bonded,
    /// The layer slides on the base; the pressure then does not depend on Poisson's ratio.
    Frictionless,
}

/// Why numbers do not make a layer.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LayerError {
    /// The thickness is not a positive, finite number.
    #[error("thickness must be a positive, finite number of mm, not {0}")]
    Thickness(f64),
    /// Poisson's ratio is out of range.
    #[error("Poisson's ratio must be in [0, 0.5], not {0}")]
    PoissonRatio(f64),
}

impl Layer {
    /// A layer of a thickness in mm and a Poisson's ratio in `[0, 0.5]` (0.5: incompressible).
    ///
    /// # Errors
    /// [`LayerError`] names the number that is out of range.
    pub fn new(thickness_mm: f64, poisson_ratio: f64, base: BaseContact) -> Result<Self, LayerError> {
        if !(thickness_mm.is_finite() && thickness_mm > 0.0) {
            return Err(LayerError::Thickness(thickness_mm));
        }
        if !(0.0..=0.5).contains(&poisson_ratio) {
            return Err(LayerError::PoissonRatio(poisson_ratio));
        }
        Ok(Self { thickness_mm, poisson_ratio, base })
    }

    /// The thickness `h`.
    pub fn thickness_mm(&self) -> f64 {
        self.thickness_mm
    }

    /// `T(K)`: share of a pressure wave of wave number `K / h`, `K >= 0`, that arrives at the base. `T(0) = 1`.
    pub fn transfer(&self, waves: f64) -> f64 {
        let k = waves;
        // Numerator and denominator times exp(-2 K), so that no large K overflows.
        let e = exp(-k);
        let (less, more) = (-expm1(-2.0 * k), 1.0 + e * e);
        match self.base {
            BaseContact::Bonded => {
                let kappa = 3.0 - 4.0 * self.poisson_ratio;
                let above = (kappa + 1.0) * e * (f64::midpoint(kappa, 1.0) * more + k * less);
                above / (kappa * (1.0 + e.powi(4)) + (4.0 * k * k + 1.0 + kappa * kappa) * e * e)
            }
            BaseContact::Frictionless if k > 0.0 => {
                e * (less + k * more) / (less * more / 2.0 + 2.0 * k * e * e)
            }
            BaseContact::Frictionless => 1.0,
        }
    }

    /// Pressure at the base under 1 N at a point.
    pub fn under_point(&self) -> BasePressure {
        self.under_disc(0.0)
    }

    /// Pressure at the base under 1 N spread evenly over a disc of this diameter.
    pub fn under_disc(&self, diameter_mm: f64) -> BasePressure {
        BasePressure { layer: *self, radius: diameter_mm.abs() / 2.0 / self.thickness_mm }
    }

    /// Standard deviation of the Gaussian that fits the pressure under a point best, in mm.
    ///
    /// It maximises the correlation over the plane with a Gaussian of unit L2 norm (the paper's Eq. 3), which is
    /// the least-squares fit of a Gaussian of free height. In the Fourier domain that is
    /// `s integral T(K) exp(-K^2 s^2 / 2) K dK`, with `s = sigma / h`.
    pub fn gaussian_sigma_mm(&self) -> f64 {
        let likeness = |s: f64| {
            s * integrate([0.0, WAVES_MAX], 1.0, |k| self.transfer(k) * exp(-k * k * s * s / 2.0) * k)
        };
        // One maximum: every layer has it between 0.4 and 0.6.
        self.thickness_mm * peak([0.1, 2.0], likeness)
    }
}

/// The pressure at the base under a unit force, about the force's axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BasePressure {
    layer: Layer,
    /// Of the disc, in thicknesses.
    radius: f64,
}

impl BasePressure {
    /// `p(r)`: pressure at a distance from the load's axis, in N/mm^2 for each N.
    ///
    /// Accurate to about 1e-11 of the pressure below the load.
    pub fn pressure_per_mm2(&self, distance_mm: f64) -> f64 {
        let distance = distance_mm.abs() / self.layer.thickness_mm;
        if distance > REACH { 0.0 } else { self.hankel(distance, j0) }
    }

    /// Share of the force that arrives within a distance of the load's axis.
    pub fn force_within(&self, distance_mm: f64) -> f64 {
        PI * distance_mm * distance_mm * self.mean_per_mm2(distance_mm)
    }

    /// Share of the force that arrives at the rectangle `[[x_min, x_max], [y_min, y_max]]`, in mm from the load's
    /// axis. Accurate to about 1e-11.
    ///
    /// With `m(r)` the mean pressure within `r`, the vector `m r / 2` has the divergence `p`: its flux through
    /// the four sides is the force.
    pub fn force_on(&self, [x_mm, y_mm]: [[f64; 2]; 2]) -> f64 {
        let panel_mm = 2.0 * self.layer.thickness_mm;
        let side = |away_mm: f64, along_mm: [f64; 2]| {
            away_mm / 2.0 * integrate(along_mm, panel_mm, |at_mm| self.mean_per_mm2(away_mm.hypot(at_mm)))
        };
        side(x_mm[1], y_mm) - side(x_mm[0], y_mm) + side(y_mm[1], x_mm) - side(y_mm[0], x_mm)
    }

    /// Mean pressure within a distance of the axis.
    fn mean_per_mm2(&self, distance_mm: f64) -> f64 {
        let distance = distance_mm.abs() / self.layer.thickness_mm;
        if distance > REACH {
            return 1.0 / (PI * distance_mm * distance_mm);
        }
        self.hankel(distance, over_disc)
    }

    /// `1/(2 pi h^2) integral T D kernel(K r/h) K dK`.
    fn hankel(&self, distance: f64, kernel: fn(f64) -> f64) -> f64 {
        // Panels of about one oscillation, and none so wide that T bends much.
        let panel = (6.0 / (distance + self.radius)).min(2.0);
        let waves = |k: f64| self.layer.transfer(k) * over_disc(k * self.radius) * kernel(k * distance) * k;
        let thickness_mm = self.layer.thickness_mm;
        integrate([0.0, WAVES_MAX], panel, waves) / (2.0 * PI * thickness_mm * thickness_mm)
    }
}

/// `2 J1(x)/x`: the mean of a wave over a disc.
fn over_disc(x: f64) -> f64 {
    if x < 1e-5 { 1.0 } else { 2.0 * j1(x) / x }
}

#[cfg(test)]
#[path = "layered_tests.rs"]
mod tests;
