//! Which covering to order for a given pitch of the elements and force resolution (paper Sec. 4).
//!
//! Point location and two-point discrimination are best under a spread of about 0.3 element widths, but an array
//! aliases unless the spread is at least [`NYQUIST_SIGMA`]; beyond that, every further spread costs acuity. So the
//! covering to order is the thinnest that gives the wanted least spread: Eq. 4 inverted,
//!
//! ```text
//! t = (sigma_wanted * pitch - sigma_intercept) / sigma_per_mm                     t, pitch in mm
//! ```
//!
//! If the sensor's own spread (the intercept) already exceeds the wanted one, no covering gives less, and the
//! thinnest one is best. This is the paper's own case: 1.11 + 0.497 t against 0.955.
//!
//! The force resolution is `f = 1 / force_steps` of one press's whole signal, summed over the elements that it reaches.

use std::ops::RangeInclusive;

use serde::Serialize;
use tactus_model::{Covering, Psf};

use crate::acuity::{AcuityError, DiscretisingSensor, Grid, NYQUIST_FREQUENCY, NYQUIST_SIGMA, passed};

/// The requirements for a covering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Distance between elements' centres, 0.05 to 100 mm.
    pub pitch_mm: f64,
    /// Converter steps in the whole signal of one press, 2 to 65,536.
    pub force_steps: u32,
    /// Least spread in pitches, 0.05 to 10; from [`NYQUIST_SIGMA`] on, there is no aliasing.
    pub min_sigma: f64,
    /// Spread against thickness, as measured.
    pub psf: Psf,
}

/// The recommended covering and its acuity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Design {
    /// Distance between elements' centres.
    pub pitch_mm: f64,
    /// Converter steps in the whole signal of one press.
    pub force_steps: u32,
    /// Least spread that was wanted, in pitches.
    pub min_sigma: f64,
    /// Least spread in pitches that prevents aliasing: [`NYQUIST_SIGMA`].
    pub nyquist_sigma: f64,
    /// The spread under which a point is located best, the least if there are several; searched from 0.05 to 1 pitches in
    /// steps of 0.01.
    pub best_for_locating: Acuity,
    /// The spread under which two points are distinguished best; searched likewise.
    pub best_for_two_points: Acuity,
    /// Thickness that gives the least wanted spread by Eq. 4; negative if the sensor's own spread is already wider, `None`
    /// if the spread does not depend on thickness.
    pub wanted_thickness_mm: Option<f64>,
    /// The covering to order.
    pub recommended: Covered,
    /// Why that covering is recommended.
    pub reason: Reason,
    /// The paper's coverings, the recommended one, and 0.5 to 6 mm in steps of 0.5 mm; by thickness.
    pub curve: Vec<Covered>,
}

/// How well positions are distinguished under a spread.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Acuity {
    /// Spread, in pitches.
    pub sigma: f64,
    /// Distinct readings of a point that moves across one element: an upper bound of the positions that can be distinguished.
    pub locations: usize,
    /// Separation at which two points first read differently from one of twice the force, mean over two hundred
    /// positions in an element; `None` if that never happens at one of them.
    pub separation_mm: Option<f64>,
}

/// A covering and the acuity under it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Covered {
    /// Thickness of the covering.
    pub thickness_mm: f64,
    /// True if it is one of the paper's four.
    pub of_the_paper: bool,
    /// Spread and acuity under it.
    #[serde(flatten)]
    pub acuity: Acuity,
    /// Share of the amplitude that passes at the Nyquist frequency.
    pub nyquist_passed: f64,
}

/// Why a covering is recommended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// It gives the wanted spread.
    GivesWanted,
    /// It gives the wanted spread, but is thicker than any that was measured: Eq. 4 is extrapolated.
    BeyondMeasured,
    /// The sensor's own spread is wider than what is wanted, so the thinnest available covering comes nearest.
    SensorAlreadyWider,
    /// The covering that would give the wanted spread is thinner than the thinnest available one, which is taken instead.
    ThinnerThanAvailable,
}

/// Why nothing can be recommended.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum DesignError {
    /// A number is out of range.
    #[error("{name} must be {range}, not {value}")]
    OutOfRange { name: &'static str, range: &'static str, value: f64 },
    /// More spread is wanted than there is, and no covering adds any.
    #[error(
        "the model's spread is {sigma:.2} pitches under any covering (sigma_per_mm = 0), less than the {min_sigma:.2} wanted: \
         take a model with the spread of at least two coverings, or want less"
    )]
    CoveringWithoutEffect { sigma: f64, min_sigma: f64 },
    /// The acuity cannot be computed for the spread of a covering.
    #[error(transparent)]
    Acuity(#[from] AcuityError),
}

impl Wanted {
    /// Recommends a covering.
    ///
    /// # Errors
    /// [`DesignError`] if a number is out of range, or no covering can give the wanted spread.
    pub fn design(&self) -> Result<Design, DesignError> {
        let Self { pitch_mm, force_steps, min_sigma, psf } = *self;
        self.check()?;
        let wanted_thickness_mm = (psf.sigma_per_mm > 0.0)
            .then(|| (min_sigma * pitch_mm - psf.sigma_intercept_mm) / psf.sigma_per_mm);
        let (thickness_mm, reason) = self.choose(wanted_thickness_mm)?;
        let searched = (5..=100).map(|hundredths| f64::from(hundredths) / 100.0).collect();
        let searched = Grid { sigmas: searched, force_resolutions: vec![self.force_resolution()] }
            .map(|sensor| self.acuity_of(sensor))?;
        let first = self.acuity(0.05)?;
        let best = |better: fn(&Acuity, &Acuity) -> bool| {
            searched.iter().fold(first, |best, one| if better(one, &best) { *one } else { best })
        };
        Ok(Design {
            pitch_mm,
            force_steps,
            min_sigma,
            nyquist_sigma: NYQUIST_SIGMA,
            best_for_locating: best(|one, other| one.locations > other.locations),
            best_for_two_points: best(|one, other| apart_mm(one) < apart_mm(other)),
            wanted_thickness_mm,
            recommended: self.under(thickness_mm)?,
            reason,
            curve: thicknesses_mm(thickness_mm)
                .into_iter()
                .map(|t| self.under(t))
                .collect::<Result<_, _>>()?,
        })
    }

    fn check(&self) -> Result<(), DesignError> {
        let within = |name, value: f64, range: RangeInclusive<f64>, said| {
            if range.contains(&value) {
                Ok(())
            } else {
                Err(DesignError::OutOfRange { name, range: said, value })
            }
        };
        within("the pitch", self.pitch_mm, 0.05..=100.0, "0.05 to 100 mm (the paper's sensor has 2)")?;
        within("the number of force steps", self.force_steps.into(), 2.0..=65_536.0, "2 to 65536")?;
        let range = "0.05 to 10 pitches (0.955 forbids aliasing)";
        within("the least spread", self.min_sigma, 0.05..=10.0, range)?;
        let intercept = "positive (a model's base.psf.sigma_intercept_mm)";
        within(
            "the spread without covering",
            self.psf.sigma_intercept_mm,
            f64::MIN_POSITIVE..=f64::MAX,
            intercept,
        )?;
        let slope = "0 or more (a model's base.psf.sigma_per_mm)";
        within("the spread's growth with thickness", self.psf.sigma_per_mm, 0.0..=f64::MAX, slope)
    }

    /// The thinnest covering that gives the wanted spread, but not thinner than the thinnest available one.
    fn choose(&self, wanted_thickness_mm: Option<f64>) -> Result<(f64, Reason), DesignError> {
        let [thinnest, .., thickest] = Covering::PAPER.map(|covering| covering.thickness_mm);
        let without = self.psf.sigma_intercept_mm / self.pitch_mm;
        Ok(match wanted_thickness_mm {
            _ if without >= self.min_sigma => (thinnest, Reason::SensorAlreadyWider),
            None => {
                return Err(DesignError::CoveringWithoutEffect { sigma: without, min_sigma: self.min_sigma });
            }
            Some(wanted) if wanted <= thinnest => (thinnest, Reason::ThinnerThanAvailable),
            // Hundredths of a mm, and not below what was wanted.
            Some(wanted) if wanted <= thickest => {
                ((100.0 * wanted - 1e-6).ceil() / 100.0, Reason::GivesWanted)
            }
            Some(wanted) => ((100.0 * wanted - 1e-6).ceil() / 100.0, Reason::BeyondMeasured),
        })
    }

    fn under(&self, thickness_mm: f64) -> Result<Covered, AcuityError> {
        let sigma = self.psf.sigma_mm(Covering { thickness_mm }) / self.pitch_mm;
        Ok(Covered {
            thickness_mm,
            of_the_paper: Covering::PAPER.contains(&Covering { thickness_mm }),
            acuity: self.acuity(sigma)?,
            nyquist_passed: passed(sigma, NYQUIST_FREQUENCY),
        })
    }

    fn acuity(&self, sigma: f64) -> Result<Acuity, AcuityError> {
        Ok(self.acuity_of(DiscretisingSensor::new(sigma, self.force_resolution())?))
    }

    fn acuity_of(&self, sensor: DiscretisingSensor) -> Acuity {
        // Half an element: the other is its mirror image.
        let places: [f64; 100] = std::array::from_fn(|nth| (nth as f64 + 0.5) / 200.0);
        let separation = sensor.mean_separation(&places);
        Acuity {
            sigma: sensor.sigma(),
            locations: sensor.locations(),
            separation_mm: separation.map(|apart| apart * self.pitch_mm),
        }
    }

    fn force_resolution(&self) -> f64 {
        1.0 / f64::from(self.force_steps)
    }
}

/// Separation; infinite if two points are never distinguished.
fn apart_mm(acuity: &Acuity) -> f64 {
    acuity.separation_mm.unwrap_or(f64::INFINITY)
}

/// Thicknesses of the curve: 0.5 to 6 mm, those of the paper, and the recommended one.
fn thicknesses_mm(recommended_mm: f64) -> Vec<f64> {
    let mut thicknesses_mm: Vec<_> = (1..=12).map(|halves| f64::from(halves) / 2.0).collect();
    thicknesses_mm.extend(Covering::PAPER.map(|covering| covering.thickness_mm));
    thicknesses_mm.push(recommended_mm);
    thicknesses_mm.sort_unstable_by(f64::total_cmp);
    thicknesses_mm.dedup();
    thicknesses_mm
}

#[cfg(test)]
#[path = "design_tests.rs"]
mod tests;
