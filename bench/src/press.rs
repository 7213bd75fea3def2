//! Tools, depths and poses.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use tactus_model::{Array, Covering, Indenter, Mesh, MeshError};
use tactus_scene::Attitude;
use tactus_scene::shapes::Scene;

/// The paper's thinnest covering, 0.04 inch.
pub const COVERING: Covering = Covering { thickness_mm: 1.016 };

/// Greatest depth of a pose.
pub const DEPTH_MAX_MM: f64 = 0.6;

/// Least depth of a pose.
const DEPTH_MIN_MM: f64 = 0.05;

/// A tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Tool {
    /// The block letter of `assets/h.stl`: 8 x 10 mm, strokes of 2 mm, 44 triangles.
    H,
    /// The same, tilted by 2 and 1 degrees, as a tool in a real holder may be.
    TiltedH,
    /// The paper's flat-ended cylinder of 1 mm.
    Cylinder,
}

/// Place, rotation and depth of a tool.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    /// Place of its axis, sensor frame.
    pub position_mm: [f64; 2],
    /// Counter-clockwise.
    pub rotation_deg: f64,
    /// Depth of its lowest point.
    pub depth_mm: f64,
}

impl Tool {
    /// The tool's shape.
    #[expect(clippy::missing_panics_doc, clippy::expect_used, reason = "a fixed shape, made in a test")]
    pub fn indenter(self) -> Indenter {
        match self {
            Self::H => Indenter::Mesh(Arc::new(Scene::H.mesh())),
            Self::TiltedH => {
                let tilt = Attitude { yaw_deg: 0.0, pitch_deg: 2.0, roll_deg: 1.0 };
                let tilted = Scene::H.mesh().turned(tilt.matrix());
                Indenter::Mesh(Arc::new(tilted.expect("the letter has a face below at any small tilt")))
            }
            Self::Cylinder => Indenter::Cylinder { diameter_mm: 1.0 },
        }
    }
}

/// `count` poses, spread evenly over the array's active area, the full turn and the depths from 0.05 mm to
/// [`DEPTH_MAX_MM`]: the fractional parts of multiples of the powers of 1/g, where `g^5 = g + 1` (M. Roberts'
/// sequence for four dimensions). The peers use the same poses.
pub fn poses(array: &Array, count: u32) -> Vec<Pose> {
    const G: f64 = 1.167_303_978_261_418_7;
    let [along_x, along_y] = array.extent_mm();
    let pose = |place: u32| {
        let within = |power: i32, [least, most]: [f64; 2]| {
            least + (most - least) * (0.5 + f64::from(place) * G.powi(-power)).fract()
        };
        Pose {
            position_mm: [within(1, along_x), within(2, along_y)],
            rotation_deg: within(3, [0.0, 360.0]),
            depth_mm: within(4, [DEPTH_MIN_MM, DEPTH_MAX_MM]),
        }
    };
    (0..count).map(pose).collect()
}

/// The lower half of a sphere of 4 mm diameter under a lid, in about `triangles` triangles.
///
/// # Errors
/// If the triangles do not make a mesh.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some hundreds of rings")]
pub fn fine_sphere(triangles: u32) -> Result<Indenter, MeshError> {
    const RADIUS_MM: f64 = 2.0;
    // Four times as many meridians as rings, two triangles in every field: 8 rings^2.
    let rings = (f64::from(triangles) / 8.0).sqrt().round().max(1.0) as u32;
    let meridians = 4 * rings;
    let mut vertices_mm = vec![[0.0, 0.0, 0.0]];
    let mut faces = Vec::new();
    for ring in 1..=rings {
        let (below, here) = (1 + (ring.max(2) - 2) * meridians, 1 + (ring - 1) * meridians);
        let (sin, cos) = (PI / 2.0 * f64::from(ring) / f64::from(rings)).sin_cos();
        for meridian in 0..meridians {
            let (y, x) = (TAU * f64::from(meridian) / f64::from(meridians)).sin_cos();
            vertices_mm.push([RADIUS_MM * sin * x, RADIUS_MM * sin * y, RADIUS_MM * (1.0 - cos)]);
            let next = (meridian + 1) % meridians;
            if ring == 1 {
                faces.push([0, here + meridian, here + next]);
            } else {
                faces.push([below + meridian, here + meridian, here + next]);
                faces.push([below + meridian, here + next, below + next]);
            }
        }
    }
    vertices_mm.push([0.0, 0.0, RADIUS_MM]);
    let (lid, rim) = (1 + rings * meridians, 1 + (rings - 1) * meridians);
    faces.extend((0..meridians).map(|meridian| [rim + meridian, rim + (meridian + 1) % meridians, lid]));
    Ok(Indenter::Mesh(Arc::new(Mesh::new(&vertices_mm, &faces)?)))
}

#[cfg(test)]
#[path = "press_tests.rs"]
mod tests;
