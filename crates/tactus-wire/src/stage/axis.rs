//! Axes of the stage.

use core::fmt;

/// An axis of the stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisName {
    /// In the plane of the covering.
    X,
    /// In the plane of the covering.
    Y,
    /// Up; the tip presses along it.
    Z,
}

/// Direction in which a controller's axis counts, in the stage's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Its coordinate increases with the stage's.
    Positive,
    /// Its coordinate decreases as the stage's increases.
    Negative,
}

impl AxisName {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Its component of a position, or of any three values by axis.
    pub fn of<T>(self, [x, y, z]: [T; 3]) -> T {
        match self {
            Self::X => x,
            Self::Y => y,
            Self::Z => z,
        }
    }

    /// Sets its component of a position.
    pub fn set(self, [x, y, z]: &mut [f64; 3], mm: f64) {
        match self {
            Self::X => *x = mm,
            Self::Y => *y = mm,
            Self::Z => *z = mm,
        }
    }
}

impl fmt::Display for AxisName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.of(["x", "y", "z"]))
    }
}

impl Direction {
    /// 1.0 or -1.0.
    pub fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
}

/// Distance between two positions.
pub(crate) fn distance_mm(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
