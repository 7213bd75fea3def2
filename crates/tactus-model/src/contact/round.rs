//! Tools that are round about their axis.

use std::f64::consts::PI;

use super::{Cut, Slice};
use crate::quadrature::{smooth, whole};

/// A tool that widens from its lowest point up to a shaft.
#[derive(Debug, Clone, Copy)]
pub(super) enum Profile {
    /// `rim^2 = h (2 radius - h)` at a height `h` above the lowest point, up to the equator.
    Sphere { radius_mm: f64 },
    /// `rim = h slope`, up to the shaft's radius.
    Cone { radius_mm: f64, slope: f64 },
}

impl Profile {
    pub(super) fn sphere(diameter_mm: f64) -> Self {
        Self::Sphere { radius_mm: diameter_mm / 2.0 }
    }

    pub(super) fn cone(diameter_mm: f64, apex_deg: f64) -> Self {
        Self::Cone { radius_mm: diameter_mm / 2.0, slope: (apex_deg.to_radians() / 2.0).tan() }
    }

    /// Slices at a depth: a stack of thin discs, one for each height above the lowest point. Along the shaft the discs
    /// have its radius.
    pub(super) fn slices(self, cut: Cut, position_mm: [f64; 2], depth_mm: f64, sigma_mm: f64) -> Vec<Slice> {
        let head_mm = depth_mm.min(self.head_mm());
        if cut == Cut::Footprint {
            return disc(position_mm, self.rim_mm(head_mm), 1.0, sigma_mm).collect();
        }
        // Under a blur much finer than the tool, bounded computing time is worth more than the last digits at the
        // tool's edge.
        let sigma_mm = sigma_mm.max(self.radius_mm() / 50.0);
        let scale_mm = sigma_mm * head_mm / self.rim_mm(head_mm);
        smooth(0.0, head_mm, scale_mm)
            .map(|(height_mm, thickness_mm)| (self.rim_mm(height_mm), thickness_mm))
            .chain((depth_mm > head_mm).then_some((self.radius_mm(), depth_mm - head_mm)))
            .flat_map(|(rim_mm, thickness_mm)| disc(position_mm, rim_mm, thickness_mm, sigma_mm))
            .collect()
    }

    /// Height at which the shaft begins.
    fn head_mm(self) -> f64 {
        match self {
            Self::Sphere { radius_mm } => radius_mm,
            Self::Cone { radius_mm, slope } => radius_mm / slope,
        }
    }

    /// Radius of the shaft.
    fn radius_mm(self) -> f64 {
        match self {
            Self::Sphere { radius_mm } | Self::Cone { radius_mm, .. } => radius_mm,
        }
    }

    /// Radius at a height up to the shaft.
    fn rim_mm(self, height_mm: f64) -> f64 {
        match self {
            Self::Sphere { radius_mm } => (height_mm * (2.0 * radius_mm - height_mm)).sqrt(),
            Self::Cone { slope, .. } => height_mm * slope,
        }
    }
}

/// Slices of a disc of even depth, at `x = radius sin(theta)` for evenly spaced `theta`.
///
/// Their blurred contribution is a smooth periodic function of `theta`, so the midpoint rule converges faster than any
/// power of the number of slices.
pub(super) fn disc(
    [x, y]: [f64; 2],
    radius_mm: f64,
    depth_mm: f64,
    sigma_mm: f64,
) -> impl Iterator<Item = Slice> {
    let slices = 6 + whole(3.0 * radius_mm / sigma_mm.max(radius_mm / 1000.0));
    let step = PI / slices as f64;
    (0..slices).map(move |slice| {
        let (sin, cos) = ((slice as f64 + 0.5) * step - PI / 2.0).sin_cos();
        let half_chord_mm = radius_mm * cos;
        Slice {
            x_mm: x + radius_mm * sin,
            y_mm: [y - half_chord_mm, y + half_chord_mm],
            weight_mm2: depth_mm * half_chord_mm * step,
            slope_mm: 0.0,
        }
    })
}
