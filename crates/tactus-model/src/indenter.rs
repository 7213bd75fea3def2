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
