//! Axes and places.

use core::fmt;

/// Which axis of the stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisName {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third, along which the tip presses.
    Z,
}

/// Which way an axis counts, seen in the stage's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// More of the controller's units are more mm.
    Positive,
    /// More of the controller's units are fewer mm.
    Negative,
}

impl AxisName {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Its part of a place, or of anything that each axis has.
    pub fn of<T>(self, [x, y, z]: [T; 3]) -> T {
        match self {
            Self::X => x,
            Self::Y => y,
            Self::Z => z,
        }
    }

    /// Puts its part into a place.
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
    /// 1 or -1.
    pub fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
}

/// Distance between two places.
pub(crate) fn distance_mm(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
