//! What the noise of one reading is known from.

use crate::numbers::Z_95;

/// The noise of one reading: the least residual that any model can leave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Floor {
    /// From frames that repeat each other in time, while the tip rests.
    Time {
        /// Standard deviation of one reading.
        rms_counts: f64,
        /// Degrees of freedom of the estimate.
        freedom: f64,
    },
    /// From presses that repeat each other: the same run, covering, tool, place (to 20 um), depth (to 5 um) and direction. It
    /// contains what differs from press to press.
    Repeats {
        /// Standard deviation of one reading.
        rms_counts: f64,
        /// Degrees of freedom of the estimate.
        freedom: f64,
    },
    /// Nothing repeats, so noise and missing physics cannot be told apart.
    None,
}

impl Floor {
    /// Standard deviation of one reading.
    pub const fn rms_counts(self) -> Option<f64> {
        match self {
            Self::Time { rms_counts, .. } | Self::Repeats { rms_counts, .. } => Some(rms_counts),
            Self::None => None,
        }
    }

    /// The same with the noise of fewer elements.
    pub(crate) const fn with_rms(self, rms_counts: f64) -> Self {
        match self {
            Self::Time { freedom, .. } => Self::Time { rms_counts, freedom },
            Self::Repeats { freedom, .. } => Self::Repeats { rms_counts, freedom },
            Self::None => Self::None,
        }
    }

    /// Degrees of freedom of the estimate.
    pub const fn freedom(self) -> Option<f64> {
        match self {
            Self::Time { freedom, .. } | Self::Repeats { freedom, .. } => Some(freedom),
            Self::None => None,
        }
    }

    /// 90 % interval of the standard deviation of one reading.
    ///
    /// # Source
    /// Quantiles of chi-square: E. B. Wilson and M. M. Hilferty, *Proc. Natl. Acad. Sci.* 17 (1931) 684.
    pub fn interval90_counts(self) -> Option<[f64; 2]> {
        let (rms_counts, spread) = (self.rms_counts()?, 2.0 / (9.0 * self.freedom()?));
        // The square root of chi-square over its degrees of freedom.
        let root = |z: f64| (1.0 - spread + z * spread.sqrt()).max(0.0).powf(1.5);
        Some([Z_95, -Z_95].map(|z| rms_counts / root(z)))
    }

    /// What the noise is known from, in a report.
    pub const fn source(self) -> &'static str {
        match self {
            Self::Time { .. } => "repeats in time",
            Self::Repeats { .. } => "repeats of a place",
            Self::None => "none",
        }
    }
}
