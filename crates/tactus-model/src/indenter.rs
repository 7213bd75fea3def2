//! The tool that presses.

use std::sync::Arc;

use crate::Mesh;

/// Shape of the indenter's lower end, axis along z; sizes in mm.
#[derive(Debug, Clone, PartialEq)]
pub enum Indenter {
    /// Flat-ended cylinder.
    Cylinder {
        /// Diameter of the flat face.
        diameter_mm: f64,
    },
    /// Sphere; depth is that of its lowest point, and above its equator its shaft is as wide as it.
    Sphere {
        /// Diameter of the sphere.
        diameter_mm: f64,
    },
    /// Cone standing on its tip under a shaft as wide as the cone's base.
    Cone {
        /// Diameter of the shaft.
        diameter_mm: f64,
        /// Full angle at the tip, in (0, 180).
        apex_deg: f64,
    },
    /// Flat-ended box; on the stage its sides run along the robot's x and y.
    Box {
        /// Side lengths along x and y.
        size_mm: [f64; 2],
    },
    /// Any shape, by its surface; shared, since a mesh may be large.
    Mesh(Arc<Mesh>),
}

impl Indenter {
    /// True if it is flat below: upright it presses its whole face equally deep.
    pub(crate) fn is_flat(&self) -> bool {
        matches!(self, Self::Cylinder { .. } | Self::Box { .. })
    }

    /// By how much the lowest point of the tool stands deeper than the foot of its axis when it leans about it: when
    /// its face stands deeper by `lean` per mm along its own x and y. Round heads roll, and stay as deep.
    pub(crate) fn lowered_mm(&self, [by_x, by_y]: [f64; 2]) -> f64 {
        match self {
            Self::Cylinder { diameter_mm } => by_x.hypot(by_y) * diameter_mm / 2.0,
            Self::Sphere { .. } | Self::Cone { .. } => 0.0,
            Self::Box { size_mm: [width_mm, height_mm] } => {
                f64::midpoint((by_x * width_mm).abs(), (by_y * height_mm).abs())
            }
            Self::Mesh(mesh) => {
                let [_, _, [lowest, _]] = mesh.bounds_mm();
                let below = |[u, v, w]: &[f64; 3]| by_x * u + by_y * v - (w - lowest);
                mesh.vertices_mm().iter().map(below).fold(f64::NEG_INFINITY, f64::max)
            }
        }
    }
}
