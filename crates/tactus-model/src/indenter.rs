//! The tool that presses.

/// Shape of the indenter's lower end, axis along z; sizes in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    /// Flat-ended box; on the stage its sides run along the robot's x and y.
    Box {
        /// Side lengths along x and y.
        size_mm: [f64; 2],
    },
}
