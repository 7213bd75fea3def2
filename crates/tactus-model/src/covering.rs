//! The elastic covering and its point spread.

/// The elastic layer on the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Covering {
    /// Thickness in mm, positive.
    pub thickness_mm: f64,
}

impl Covering {
    /// The paper's coverings: 0.04, 0.1, 0.14 and 0.2 inch.
    pub const PAPER: [Self; 4] = [
        Self { thickness_mm: 1.016 },
        Self { thickness_mm: 2.54 },
        Self { thickness_mm: 3.556 },
        Self { thickness_mm: 5.08 },
    ];
}

/// Width of the Gaussian point spread function against covering thickness (Eq. 4).
///
/// `sigma_mm = sigma_intercept_mm + sigma_per_mm * thickness_mm`
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Psf {
    /// Spread without any covering: the sensor's own.
    pub sigma_intercept_mm: f64,
    /// Increase of the spread per mm of covering.
    pub sigma_per_mm: f64,
}

impl Psf {
    /// The paper's fit, `sigma = 1.11 + 0.497 t` in pitches of 2.0 mm (Eq. 4), in mm.
    pub const PAPER: Self = Self { sigma_intercept_mm: 2.22, sigma_per_mm: 0.497 };

    /// Standard deviation of the spread under a covering, in mm.
    pub fn sigma_mm(&self, covering: Covering) -> f64 {
        self.sigma_intercept_mm + self.sigma_per_mm * covering.thickness_mm
    }
}
