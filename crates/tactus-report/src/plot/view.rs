//! Oblique views of solids in parallel projection with flat shading.

mod order;

use std::fmt;

use super::Panel;

/// A flat, convex face of a solid; its corners run counter-clockwise as seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Corners in mm.
    pub corners_mm: Vec<[f64; 3]>,
    /// Colour and opacity.
    pub paint: Paint,
}

/// A colour in full light, and its opacity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// Red, green and blue, 0 to 255.
    pub rgb: [f64; 3],
    /// 0 transparent, 1 opaque.
    pub opacity: f64,
}

/// Faces as a distant viewer sees them; the panel's origin is the image of the point (0, 0, 0).
///
/// Faces are drawn back to front; intersecting faces are cut.
#[derive(Debug, Clone, PartialEq)]
pub struct ObliqueView {
    /// The faces. A face may cut those after it in this list, so faces that must stay whole come first.
    pub faces: Vec<Face>,
    /// Direction of the viewer in the plane, from x towards y.
    pub azimuth_deg: f64,
    /// Elevation of the viewer above the plane of x and y; negative below it.
    pub elevation_deg: f64,
    /// Scale.
    pub px_per_mm: f64,
}

impl Face {
    /// The six sides of a box with these ranges of x, y and z: top, sides, bottom.
    pub fn of_box([x, y, z]: [[f64; 2]; 3], paint: Paint) -> [Self; 6] {
        let corner = |[i, j, k]: [usize; 3]| [x[i], y[j], z[k]];
        let around = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let wall = |[[a, b], [c, d]]: [[usize; 2]; 2]| vec![[a, b, 0], [c, d, 0], [c, d, 1], [a, b, 1]];
        [
            around.map(|[i, j]| [i, j, 1]).to_vec(),
            wall([around[0], around[1]]),
            wall([around[1], around[2]]),
            wall([around[2], around[3]]),
            wall([around[3], around[0]]),
            around.map(|[i, j]| [j, i, 0]).to_vec(),
        ]
        .map(|corners| Self { corners_mm: corners.into_iter().map(corner).collect(), paint })
    }
}

impl ObliqueView {
    /// Image of a point, in px to the right of the origin and downwards.
    pub fn place_px(&self, point_mm: [f64; 3]) -> [f64; 2] {
        let [right, up, _] = self.axes();
        [self.px_per_mm * dot(point_mm, right), -self.px_per_mm * dot(point_mm, up)]
    }

    /// Directions rightwards, upwards and towards the viewer.
    fn axes(&self) -> [[f64; 3]; 3] {
        let (sin_az, cos_az) = self.azimuth_deg.to_radians().sin_cos();
        let (sin_el, cos_el) = self.elevation_deg.to_radians().sin_cos();
        [
            [-sin_az, cos_az, 0.0],
            [-sin_el * cos_az, -sin_el * sin_az, cos_el],
            [cos_el * cos_az, cos_el * sin_az, sin_el],
        ]
    }
}

impl Panel for ObliqueView {
    fn draw(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [right, _, viewer] = self.axes();
        // Light comes from the viewer's upper left.
        let upright = [0.0, 0.0, viewer[2].signum()];
        let light = [0, 1, 2].map(|axis| 0.7 * viewer[axis] + 0.5 * upright[axis] - 0.35 * right[axis]);
        let seen = self.faces.iter().filter(|face| dot(order::normal(face), viewer) > 1e-9);
        let faces = order::back_to_front(seen.cloned().collect());
        f.write_str(r#"<g stroke-width="0.7" stroke-linejoin="round">"#)?;
        let colour = |face: &Face| colour(face, light);
        for of_one_colour in faces.chunk_by(|one, other| colour(one) == colour(other)) {
            let Some(first) = of_one_colour.first() else { continue };
            let (fill, opacity) = (colour(first), first.paint.opacity);
            if opacity < 1.0 {
                write!(f, r#"<path fill="{fill}" fill-opacity="{opacity}" d=""#)?;
            } else {
                // The stroke closes the hairline between neighbours.
                write!(f, r#"<path fill="{fill}" stroke="{fill}" d=""#)?;
            }
            for face in of_one_colour {
                for (nth, corner) in face.corners_mm.iter().enumerate() {
                    let [x, y] = self.place_px(*corner);
                    write!(f, "{}{x:.1} {y:.1}", if nth == 0 { "M" } else { "L" })?;
                }
                f.write_str("Z")?;
            }
            f.write_str(r#""/>"#)?;
        }
        f.write_str("</g>")
    }
}

/// The face's colour in the light that falls on it, as `#rrggbb`.
fn colour(face: &Face, light: [f64; 3]) -> String {
    let shade = (0.54 + 0.46 * dot(order::normal(face), light)).clamp(0.3, 1.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 255")]
    let [r, g, b] = face.paint.rgb.map(|part| (shade * part).clamp(0.0, 255.0).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
#[path = "view_tests.rs"]
mod tests;
