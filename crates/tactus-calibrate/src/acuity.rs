//! Spatial acuity of a row of quantising elements (paper Sec. 4, Eq. 5-8, Fig. 6).
//!
//! Elements of width 1 stand side by side; a point that presses at `mu` with unit force is spread by a Gaussian
//! (Eq. 7), and each of five elements integrates its share (Eq. 5) and rounds it to a multiple of the force
//! resolution `f`:
//!
//! ```text
//! S_i      = Phi((i + 1 - mu) / sigma) - Phi((i - mu) / sigma)        i = -2..2, the middle element is [0, 1]
//! reading_i = floor(S_i / f + 1/2)                                      in steps of f
//! ```
//!
//! Eq. 6 as printed, `floor(S + f / 2)`, gives at most two readings, 0 and 1, whatever `f` is. The text around
//! it says "rounding to the nearest multiple of f", so this module does that. All lengths are in element widths.
//!
//! - *Localisation* (Fig. 6a): [`DiscretisingSensor::locations`], how many distinct readings there are as a point
//!   goes over one element in steps of `0.02 f`.
//! - *Two points* (Fig. 6b): [`DiscretisingSensor::separation`], how far two points must move apart, in steps of
//!   `0.02 f`, until they read otherwise than one point of twice the force.
//! - *Aliasing*: [`NYQUIST_SIGMA`] and [`passed`].
//!
//! Both results are bounds: they assume no noise and a perfectly known sensor.
//!
//! # Steps that are skipped
//!
//! A reading changes only where some `S_i` crosses a rounding boundary. While the points move by `h`, `S_i` moves
//! forwards by at most `|S_i'| h + M h^2 / 2` and backwards by at most `M h^2 / 2 - |S_i'| h`, as `|S_i''| <= M`; steps
//! within which neither reaches a boundary cannot change any reading and are skipped. The result equals that of stepping
//! through all of them, to the last count; the tests check this.
//!
//! ```
//! use tactus_calibrate::acuity::DiscretisingSensor;
//!
//! let sensor = DiscretisingSensor::new(0.27, 1.0 / 100.0)?;
//! assert_eq!(sensor.locations(), 189);
//! # Ok::<(), tactus_calibrate::acuity::AcuityError>(())
//! ```

use std::f64::consts::{FRAC_1_PI, FRAC_1_SQRT_2, PI};
use std::iter;

use libm::{erfc, exp, pow};
use rayon::prelude::*;

/// Elements that are read: the pressed one and two on either side.
pub const ELEMENTS: usize = 5;

/// The spread whose frequency response has fallen by three of its standard deviations at the Nyquist frequency, in
/// element widths: `3 sigma' = 1/2` with `sigma' = 1 / (2 pi sigma)` (Eq. 8), so 0.955, which the paper rounds to 1.0.
pub const NYQUIST_SIGMA: f64 = 3.0 * FRAC_1_PI;

/// The Nyquist frequency of elements of width 1, in cycles per element width.
pub const NYQUIST_FREQUENCY: f64 = 0.5;

/// The paper's positions of the two points' midpoint within an element: 0, 0.1, ..., 0.9.
pub const OFFSETS: [f64; 10] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];

/// Positions midway between those of the paper: 0.05, 0.15, ..., 0.95.
pub const OFFSETS_BETWEEN: [f64; 10] = [0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95];

/// A step of the moving points, in force resolutions (paper, Sec. 4).
const STEP_PER_RESOLUTION: f64 = 0.02;

/// What each of the five elements reads, in steps of the force resolution.
pub type QuantisedReading = [i32; ELEMENTS];

/// Share of the amplitude of a frequency that a Gaussian spread lets through: `exp(-2 (pi sigma u)^2)`, `sigma` in
/// element widths and `u` in cycles per element width (Sec. 4).
pub fn passed(sigma: f64, cycles_per_element: f64) -> f64 {
    let turn = PI * sigma * cycles_per_element;
    exp(-2.0 * turn * turn)
}

/// Why the parameters describe no sensor.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum AcuityError {
    /// The spread is out of range.
    #[error("a spread must be between 0.001 and 100 element widths, not {sigma}")]
    Sigma { sigma: f64 },
    /// The force resolution is out of range.
    #[error("a force resolution must be between 0.00001 and 1 of a press's force, not {force_resolution}")]
    ForceResolution { force_resolution: f64 },
}

/// Five quantising elements in a row under a Gaussian spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscretisingSensor {
    sigma: f64,
    force_resolution: f64,
}

impl DiscretisingSensor {
    /// With a spread in element widths and a force resolution as a share of one press's whole force.
    ///
    /// # Errors
    /// [`AcuityError`] if the spread is not within 0.001 to 100, or the resolution not within 0.00001 to 1.
    pub fn new(sigma: f64, force_resolution: f64) -> Result<Self, AcuityError> {
        if !(1e-3..=100.0).contains(&sigma) {
            return Err(AcuityError::Sigma { sigma });
        }
        if !(1e-5..=1.0).contains(&force_resolution) {
            return Err(AcuityError::ForceResolution { force_resolution });
        }
        Ok(Self { sigma, force_resolution })
    }

    /// The spread, in element widths.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// The force resolution, as a share of one press's force.
    pub fn force_resolution(&self) -> f64 {
        self.force_resolution
    }

    /// What the elements read of points of unit force (Eq. 5-7).
    pub fn reading<const N: usize>(&self, points: [f64; N]) -> QuantisedReading {
        self.round(self.shares(points))
    }

    /// Distinct readings of a point that goes from one edge of the middle element, 0, to the other, 1 (Fig. 6a).
    pub fn locations(&self) -> usize {
        // The last step is at the far edge if 1 / (0.02 f) is whole.
        let last = (1.0 / self.step() * (1.0 + 1e-12)).floor();
        let mut readings: Vec<_> = self.glide([0.0], [1.0], last).map(|(_, reading)| reading).collect();
        readings.sort_unstable();
        readings.dedup();
        readings.len()
    }

    /// Separation at which two points with midpoint `offset` first read differently from two at the same place (Fig. 6b).
    ///
    /// `None` if they never do, however far they move apart: the spread is so wide and the resolution so coarse that
    /// hardly anything is read even at separation 0.
    pub fn separation(&self, offset: f64) -> Option<f64> {
        // Then both are beyond the five elements by more than nine spreads, which leaves nothing of them.
        let far = (2.0 * ELEMENTS as f64 + 18.0 * self.sigma) / self.step();
        let together = self.reading([offset; 2]);
        self.glide([offset; 2], [-0.5, 0.5], far)
            .find(|(_, reading)| *reading != together)
            .map(|(step, _)| step * self.step())
    }

    /// Mean of [`DiscretisingSensor::separation`] over `offsets`; `None` without offsets, or if it is `None` at one.
    pub fn mean_separation(&self, offsets: &[f64]) -> Option<f64> {
        let separations = offsets.iter().map(|offset| self.separation(*offset));
        let sum: f64 = separations.sum::<Option<f64>>()?;
        (!offsets.is_empty()).then(|| sum / offsets.len() as f64)
    }

    fn step(&self) -> f64 {
        STEP_PER_RESOLUTION * self.force_resolution
    }

    /// Numbers and readings of the steps from 0 to `last` of points that move from `start` by `velocity` times the
    /// distance, without the steps that cannot read differently from the one before them.
    fn glide<const N: usize>(
        &self,
        start: [f64; N],
        velocity: [f64; N],
        last: f64,
    ) -> impl Iterator<Item = (f64, QuantisedReading)> {
        let mut next = 0.0;
        iter::from_fn(move || {
            let step = next;
            let points = std::array::from_fn(|nth| start[nth] + velocity[nth] * (step * self.step()));
            let shares = self.shares(points);
            next += 1.0 + (self.clearance(shares, points, velocity) / self.step()).floor();
            (step <= last).then(|| (step, self.round(shares)))
        })
    }

    /// `S_i`, summed over points.
    fn shares<const N: usize>(&self, points: [f64; N]) -> [f64; ELEMENTS] {
        let mut shares = [0.0; ELEMENTS];
        for point in points {
            let below = EDGES.map(|edge| normal((edge - point) / self.sigma));
            for (nth, share) in shares.iter_mut().enumerate() {
                *share += below[nth + 1] - below[nth];
            }
        }
        shares
    }

    fn round(&self, shares: [f64; ELEMENTS]) -> QuantisedReading {
        #[expect(clippy::cast_possible_truncation, reason = "at most 2 / 0.00001")]
        shares.map(|share| (share / self.force_resolution + 0.5).floor() as i32)
    }

    /// How far the points can move without any share crossing a rounding boundary.
    fn clearance<const N: usize>(
        &self,
        shares: [f64; ELEMENTS],
        points: [f64; N],
        velocity: [f64; N],
    ) -> f64 {
        // The density's slope, at most that at one spread from its middle, at each of an element's two edges.
        let steepest = 2.0 * density(1.0) / (self.sigma * self.sigma);
        let bend = steepest * velocity.iter().map(|v| v * v).sum::<f64>();
        let mut slopes = [0.0; ELEMENTS];
        for (point, velocity) in points.into_iter().zip(velocity) {
            let along = EDGES.map(|edge| density((edge - point) / self.sigma) / self.sigma);
            for (nth, slope) in slopes.iter_mut().enumerate() {
                *slope += velocity * (along[nth] - along[nth + 1]);
            }
        }
        // Far more than rounding errors of the shares and of the points' places can make.
        let doubt = 1e-14 * (1.0 + 1.0 / self.sigma);
        let clear = |(share, slope): (f64, f64)| {
            let above = (share / self.force_resolution + 0.5).fract();
            let [ahead, behind] = if slope > 0.0 { [1.0 - above, above] } else { [above, 1.0 - above] };
            let [ahead, behind] = [ahead, behind].map(|part| part * self.force_resolution - doubt);
            if ahead.min(behind) <= 0.0 {
                return 0.0;
            }
            // The first roots of ahead = |slope| h + bend h^2 / 2 and of behind = bend h^2 / 2 - |slope| h.
            let root = |left: f64| (slope * slope + 2.0 * bend * left).sqrt();
            let reaches = 2.0 * ahead / (slope.abs() + root(ahead));
            reaches.min((slope.abs() + root(behind)) / bend)
        };
        shares.into_iter().zip(slopes).map(clear).fold(f64::INFINITY, f64::min)
    }
}

/// Spreads and force resolutions of a panel of Fig. 6.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// In element widths.
    pub sigmas: Vec<f64>,
    /// As shares of one press's force.
    pub force_resolutions: Vec<f64>,
}

impl Grid {
    /// Spreads of Fig. 6, in element widths. The paper gives no ranges; with these, the optimum of Fig. 6b agrees with the
    /// paper's text.
    pub const SIGMAS: [f64; 2] = [0.03, 10.0];
    /// Force steps `1 / f` of Fig. 6; the paper gives no range.
    pub const FORCE_STEPS: [f64; 2] = [4.0, 256.0];

    /// 25 spreads and 25 force resolutions of whole numbers of steps, as a converter has: 4, 5, 6, 7, 8, 10, ..., 256.
    pub fn whole() -> Self {
        let mut grid = Self::even(25);
        for force_resolution in &mut grid.force_resolutions {
            *force_resolution = 1.0 / (1.0 / *force_resolution).round();
        }
        grid
    }

    /// `count` spreads and as many force resolutions, evenly spaced on a logarithmic scale over [`Grid::SIGMAS`] and
    /// [`Grid::FORCE_STEPS`], the coarsest first. Hardly any is one of a whole number of steps.
    pub fn even(count: usize) -> Self {
        let places = || (0..count).map(|nth| nth as f64 / count.saturating_sub(1).max(1) as f64);
        let along = |[from, to]: [f64; 2], share: f64| from * pow(to / from, share);
        Self {
            sigmas: places().map(|share| along(Self::SIGMAS, share)).collect(),
            force_resolutions: places().map(|share| 1.0 / along(Self::FORCE_STEPS, share)).collect(),
        }
    }

    /// The value of `of` for the sensor of every cell, row-major, one row per force resolution. The threads of the current
    /// rayon pool share the work; the result does not depend on their number.
    ///
    /// # Errors
    /// As [`DiscretisingSensor::new`], for the first cell that fails.
    pub fn map<T: Send>(&self, of: impl Fn(DiscretisingSensor) -> T + Sync) -> Result<Vec<T>, AcuityError> {
        let cells = self.force_resolutions.iter().flat_map(|f| self.sigmas.iter().map(|sigma| [*sigma, *f]));
        let sensors = cells.map(|[sigma, f]| DiscretisingSensor::new(sigma, f));
        let sensors = sensors.collect::<Result<Vec<_>, _>>()?;
        // One cell a job: fine force resolutions take far longer than coarse ones.
        Ok(sensors.into_par_iter().with_max_len(1).map(&of).collect())
    }
}

/// Where the five elements begin and end.
const EDGES: [f64; ELEMENTS + 1] = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0];

/// `Phi(z)`, the normal distribution.
fn normal(z: f64) -> f64 {
    0.5 * erfc(-z * FRAC_1_SQRT_2)
}

/// `phi(z)`, its density.
fn density(z: f64) -> f64 {
    const AT_ZERO: f64 = 0.398_942_280_401_432_7;
    AT_ZERO * exp(-0.5 * z * z)
}

#[cfg(test)]
#[path = "acuity_tests.rs"]
mod tests;
