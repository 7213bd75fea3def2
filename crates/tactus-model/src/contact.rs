//! A tool standing in the covering, cut into slices that the blur integrates in closed form.

use std::f64::consts::PI;

use crate::Indenter;
use crate::quadrature::gauss_legendre;

/// A tool at a place and depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// The tool.
    pub indenter: Indenter,
    /// Its axis, sensor frame.
    pub position_mm: [f64; 2],
    /// Angle from the sensor's x axis to the tool's, counter-clockwise; matters to a box only. A box
    /// along the robot's axes stands at minus the registration's rotation.
    pub rotation_deg: f64,
    /// How far its lowest point stands below the undeformed surface; at or above it (<= 0) nothing presses.
    pub depth_mm: f64,
}

/// A strip of the penetration map, parallel to y.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slice {
    /// Where it stands.
    pub(crate) x_mm: f64,
    /// From where to where it reaches.
    pub(crate) y_mm: [f64; 2],
    /// Its width times its depth.
    pub(crate) weight_mm2: f64,
}

impl Contact {
    /// Cuts the penetration map into slices, finely enough for a blur of `sigma_mm` that sums over them
    /// agree with the integrals to about 1e-11 of the volume.
    pub(crate) fn slices(&self, sigma_mm: f64) -> Vec<Slice> {
        let Self { indenter, position_mm, rotation_deg, depth_mm } = *self;
        if depth_mm <= 0.0 {
            return Vec::new();
        }
        // Under a blur much finer than the tool, what a computation may take comes before the last digits of
        // the tool's edge.
        match indenter {
            Indenter::Cylinder { diameter_mm } => {
                let radius_mm = diameter_mm / 2.0;
                disc(position_mm, radius_mm, depth_mm, sigma_mm.max(radius_mm / 1000.0)).collect()
            }
            Indenter::Sphere { diameter_mm } => {
                let radius_mm = diameter_mm / 2.0;
                ball(position_mm, radius_mm, depth_mm, sigma_mm.max(radius_mm / 50.0))
            }
            Indenter::Box { size_mm: [width_mm, height_mm] } => {
                let half_mm = [width_mm / 2.0, height_mm / 2.0];
                let finest_mm = width_mm.max(height_mm) / 1000.0;
                rectangle(position_mm, half_mm, rotation_deg, depth_mm, sigma_mm.max(finest_mm))
            }
        }
    }
}

/// Slices of a disc of even depth, at `x = radius sin(theta)` for evenly spaced `theta`.
///
/// What a blur makes of them is a smooth function of `theta` that goes on periodically beyond the disc's
/// edges, so that the midpoint rule converges faster than any power of the number of slices.
fn disc([x, y]: [f64; 2], radius_mm: f64, depth_mm: f64, sigma_mm: f64) -> impl Iterator<Item = Slice> {
    let slices = 6 + whole(3.0 * radius_mm / sigma_mm);
    let step = PI / slices as f64;
    (0..slices).map(move |slice| {
        let (sin, cos) = ((slice as f64 + 0.5) * step - PI / 2.0).sin_cos();
        let half_chord_mm = radius_mm * cos;
        Slice {
            x_mm: x + radius_mm * sin,
            y_mm: [y - half_chord_mm, y + half_chord_mm],
            weight_mm2: depth_mm * half_chord_mm * step,
        }
    })
}

/// Slices of a ball: a stack of thin discs, one for each height above its lowest point; above its equator
/// the discs stay as large as the equator.
fn ball(position_mm: [f64; 2], radius_mm: f64, depth_mm: f64, sigma_mm: f64) -> Vec<Slice> {
    let cap_mm = depth_mm.min(radius_mm);
    let rim_mm = |height_mm: f64| (height_mm * (2.0 * radius_mm - height_mm)).sqrt();
    let panels = 1 + whole(rim_mm(cap_mm) / (2.0 * sigma_mm));
    gauss_legendre(0.0, cap_mm, panels)
        .map(|(height_mm, thickness_mm)| (rim_mm(height_mm), thickness_mm))
        .chain((depth_mm > radius_mm).then_some((radius_mm, depth_mm - radius_mm)))
        .flat_map(|(rim_mm, thickness_mm)| disc(position_mm, rim_mm, thickness_mm, sigma_mm))
        .collect()
}

/// Slices of a turned rectangle of even depth; its corners part the ranges of x in which it is a trapezium.
fn rectangle(
    [x, y]: [f64; 2],
    [half_u, half_v]: [f64; 2],
    rotation_deg: f64,
    depth_mm: f64,
    sigma_mm: f64,
) -> Vec<Slice> {
    let (sin, cos) = rotation_deg.to_radians().sin_cos();
    let (along_u, along_v) = ((half_u * cos).abs(), (half_v * sin).abs());
    let corners =
        [-along_u - along_v, -(along_u - along_v).abs(), (along_u - along_v).abs(), along_u + along_v];
    // In the plane |u| <= half_u and |v| <= half_v are two bands; at one x each is a range of y (without
    // ends where the band runs along y).
    let band = |one: f64, other: f64| [one.min(other), one.max(other)];
    let chord = |dx: f64| {
        let by_u = band((half_u - dx * cos) / sin, (-half_u - dx * cos) / sin);
        let by_v = band((half_v + dx * sin) / cos, (-half_v + dx * sin) / cos);
        [by_u[0].max(by_v[0]), by_u[1].min(by_v[1])]
    };
    corners
        .windows(2)
        .filter_map(|pair| <[f64; 2]>::try_from(pair).ok())
        .filter(|[from, to]| to > from)
        .flat_map(|[from, to]| gauss_legendre(from, to, 1 + whole((to - from) / (2.0 * sigma_mm))))
        .map(|(dx, width_mm)| {
            let [low, high] = chord(dx);
            Slice { x_mm: x + dx, y_mm: [y + low, y + high], weight_mm2: depth_mm * width_mm }
        })
        .collect()
}

/// The next whole number.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "not negative, and some thousands at most"
)]
fn whole(number: f64) -> usize {
    number.ceil() as usize
}

#[cfg(test)]
#[path = "contact_tests.rs"]
mod tests;
