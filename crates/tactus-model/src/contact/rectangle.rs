//! Boxes.

use super::Slice;
use crate::quadrature::smooth;

/// Slices of a turned rectangle of even depth; its corners part the ranges of x in which it is a trapezium.
pub(super) fn slices(
    [x, y]: [f64; 2],
    [width_mm, height_mm]: [f64; 2],
    rotation_deg: f64,
    depth_mm: f64,
    sigma_mm: f64,
) -> Vec<Slice> {
    // As for round tools: bounded computing time is worth more than the last digits at an edge.
    let sigma_mm = sigma_mm.max(width_mm.max(height_mm) / 1000.0);
    let [half_u, half_v] = [width_mm / 2.0, height_mm / 2.0];
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
        .flat_map(|[from, to]| {
            // Where a side runs nearly along y, an end goes far within a narrow range.
            let (starts, ends) = (chord(from), chord(to));
            let goes_mm = (ends[0] - starts[0]).abs().max((ends[1] - starts[1]).abs());
            // A side along y has no end in its band.
            let goes_mm = goes_mm.min(width_mm.hypot(height_mm));
            smooth(from, to, sigma_mm * ((to - from) / goes_mm).min(1.0))
        })
        .map(|(dx, width_mm)| {
            let [low, high] = chord(dx);
            Slice { x_mm: x + dx, y_mm: [y + low, y + high], weight_mm2: depth_mm * width_mm, slope_mm: 0.0 }
        })
        .collect()
}
