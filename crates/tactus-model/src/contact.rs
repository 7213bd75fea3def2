//! A tool standing in the covering, cut into slices that the blur integrates in closed form.

mod mesh;
mod rectangle;
mod round;

use crate::Indenter;

/// A tool at a place and depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// The tool.
    pub indenter: Indenter,
    /// Its axis, sensor frame.
    pub position_mm: [f64; 2],
    /// Angle from the sensor's x axis to the tool's, counter-clockwise; matters to a box or mesh only. One
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

/// What is to be cut into slices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cut {
    /// The penetration map `I`.
    Penetration,
    /// Its derivative by depth: 1 where the tool touches, 0 elsewhere.
    Footprint,
}

impl Contact {
    /// Cuts the penetration map into slices, finely enough for a blur of `sigma_mm` that sums over them
    /// agree with the integrals to about 1e-11 of the volume (a mesh: see its module).
    pub(crate) fn slices(&self, sigma_mm: f64) -> Vec<Slice> {
        self.cut(Cut::Penetration, sigma_mm)
    }

    /// Cuts the area that the tool touches into slices, as if pressed 1 mm deep all over: the derivative of
    /// the penetration map by depth.
    pub(crate) fn footprint(&self, sigma_mm: f64) -> Vec<Slice> {
        self.cut(Cut::Footprint, sigma_mm)
    }

    fn cut(&self, cut: Cut, sigma_mm: f64) -> Vec<Slice> {
        let Self { indenter, position_mm, rotation_deg, depth_mm } = self;
        if *depth_mm <= 0.0 {
            return Vec::new();
        }
        let even_mm = if cut == Cut::Footprint { 1.0 } else { *depth_mm };
        match indenter {
            Indenter::Cylinder { diameter_mm } => {
                round::disc(*position_mm, diameter_mm / 2.0, even_mm, sigma_mm).collect()
            }
            Indenter::Sphere { diameter_mm } => {
                let profile = round::Profile::sphere(*diameter_mm);
                profile.slices(cut, *position_mm, *depth_mm, sigma_mm)
            }
            Indenter::Cone { diameter_mm, apex_deg } => {
                let profile = round::Profile::cone(*diameter_mm, *apex_deg);
                profile.slices(cut, *position_mm, *depth_mm, sigma_mm)
            }
            Indenter::Box { size_mm } => {
                rectangle::slices(*position_mm, *size_mm, *rotation_deg, even_mm, sigma_mm)
            }
            Indenter::Mesh(mesh) => mesh::slices(cut, mesh, *position_mm, *rotation_deg, *depth_mm, sigma_mm),
        }
    }
}

#[cfg(test)]
#[path = "contact_tests.rs"]
mod tests;
