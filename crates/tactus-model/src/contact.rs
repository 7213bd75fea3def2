//! A tool in the covering, cut into slices over which the blur is integrated in closed form.

mod mesh;
mod outline;
mod rectangle;
mod round;

pub(crate) use outline::{Edge, Node, Outline, Outliner};

use crate::Indenter;
use crate::quadrature::smooth;

/// A tool at a place and depth.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Shape and size of the tool that presses.
    pub indenter: Indenter,
    /// Position of the tool's axis, sensor frame.
    pub position_mm: [f64; 2],
    /// Angle from the sensor's x axis to the tool's, counter-clockwise; matters for a box or mesh only. For a tool aligned
    /// with the robot's axes it is minus the registration's rotation.
    pub rotation_deg: f64,
    /// Depth of the tool's lowest point below the undeformed surface. There is no contact at 0 or less.
    pub depth_mm: f64,
}

/// A strip of the penetration map, parallel to y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slice {
    /// Position along x.
    pub(crate) x_mm: f64,
    /// Least and greatest y.
    pub(crate) y_mm: [f64; 2],
    /// Its width times its depth in the middle of the strip.
    pub(crate) weight_mm2: f64,
    /// By how much the weight grows per mm of y: only under a tool that leans.
    pub(crate) slope_mm: f64,
}

/// A line in a plane of constant x: its two ends, each as y and depth below the surface.
type Line = [[f64; 2]; 2];

/// The function that is cut into slices, or integrated along edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cut {
    /// The penetration map `I`.
    Penetration,
    /// Its derivative by depth: 1 where the tool touches, 0 elsewhere.
    Footprint,
}

/// What a tool presses.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Pressed {
    /// Its outline: a closed mesh, unless a part of it hides another.
    Outline(Outline),
    /// Slices of it: any other tool.
    Slices(Vec<Slice>),
}

impl Contact {
    /// What the tool presses, or the area that it touches. `lean` and accuracy: as of [`Contact::leaning`].
    pub(crate) fn pressed(&self, cut: Cut, lean: [f64; 2], sigma_mm: f64) -> Pressed {
        match (self.outline(lean), cut) {
            (Some(outline), _) => Pressed::Outline(outline),
            (None, Cut::Penetration) => Pressed::Slices(self.leaning(lean, sigma_mm)),
            (None, Cut::Footprint) => Pressed::Slices(self.footprint(sigma_mm)),
        }
    }

    /// Cuts the penetration map into slices so fine that under a blur of `sigma_mm` sums over them agree with the
    /// integrals to about 1e-11 of the volume (a mesh: see its module).
    pub(crate) fn slices(&self, sigma_mm: f64) -> Vec<Slice> {
        self.cut(Cut::Penetration, sigma_mm)
    }

    /// Cuts the area that the tool touches into slices, as if pressed 1 mm deep all over: the derivative of
    /// the penetration map by depth.
    pub(crate) fn footprint(&self, sigma_mm: f64) -> Vec<Slice> {
        self.cut(Cut::Footprint, sigma_mm)
    }

    /// As [`Contact::slices`], for a tool that leans: its face is deeper by `lean` per mm along its own x and y, and its
    /// lowest point is at the contact's depth. A lean does not change round heads.
    ///
    /// Accuracy: the same while the whole face touches, otherwise about 1e-4 of the volume (a mesh: always the same). Each slice of a flat
    /// face has a slope along y, of which the blur has a closed form.
    pub(crate) fn leaning(&self, lean: [f64; 2], sigma_mm: f64) -> Vec<Slice> {
        let Self { indenter, position_mm: [x, y], rotation_deg, depth_mm } = self;
        if lean.iter().all(|by| *by == 0.0) || *depth_mm <= 0.0 {
            return self.slices(sigma_mm);
        }
        let lowered_mm = indenter.lowered_mm(lean);
        // Where the surface cuts through the face, the penetration map has a kink.
        let fine_mm = if *depth_mm < 2.0 * lowered_mm { sigma_mm / 16.0 } else { sigma_mm };
        let strips: Vec<Slice> = match indenter {
            Indenter::Cylinder { diameter_mm } => {
                round::disc([*x, *y], diameter_mm / 2.0, 1.0, fine_mm).collect()
            }
            Indenter::Box { size_mm } => rectangle::slices([*x, *y], *size_mm, *rotation_deg, 1.0, fine_mm),
            Indenter::Sphere { .. } | Indenter::Cone { .. } => return self.slices(sigma_mm),
            Indenter::Mesh(mesh) => {
                let depth_mm = depth_mm - lowered_mm;
                let cut = Cut::Penetration;
                return mesh::slices(cut, mesh, [*x, *y], *rotation_deg, depth_mm, lean, sigma_mm);
            }
        };
        let (sin, cos) = rotation_deg.to_radians().sin_cos();
        let [by_x, by_y] = [cos * lean[0] - sin * lean[1], sin * lean[0] + cos * lean[1]];
        let sloped = |Slice { x_mm, y_mm, weight_mm2: width_mm, .. }: Slice| {
            let below = |y_mm: f64| depth_mm - lowered_mm + by_x * (x_mm - x) + by_y * (y_mm - y);
            let [from, to] = below_surface(y_mm.map(|y_mm| [y_mm, below(y_mm)]))?;
            let weight_mm2 = width_mm * f64::midpoint(from[1], to[1]);
            Some(Slice { x_mm, y_mm: [from[0], to[0]], weight_mm2, slope_mm: width_mm * by_y })
        };
        strips.into_iter().filter_map(sloped).collect()
    }

    /// The depth from which the whole of a flat face touches that leans; `None` for other tools. From there on the penetration grows
    /// evenly with depth.
    pub(crate) fn whole_from_mm(&self, lean: [f64; 2]) -> Option<f64> {
        self.indenter.is_flat().then(|| 2.0 * self.indenter.lowered_mm(lean))
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
            Indenter::Mesh(mesh) => {
                mesh::slices(cut, mesh, *position_mm, *rotation_deg, *depth_mm, [0.0; 2], sigma_mm)
            }
        }
    }
}

/// The part of a line below the surface.
fn below_surface([from, to]: Line) -> Option<Line> {
    let at_surface = || {
        let share = from[1] / (from[1] - to[1]);
        [from[0] + share * (to[0] - from[0]), 0.0]
    };
    match (from[1] > 0.0, to[1] > 0.0) {
        (true, true) => Some([from, to]),
        (true, false) => Some([from, at_surface()]),
        (false, true) => Some([at_surface(), to]),
        (false, false) => None,
    }
}

/// Adds slices of a line: one for the depth that the whole line has, and a stack of thin layers that become shorter with
/// depth.
fn stack(x_mm: f64, width_mm: f64, line: Line, sigma_mm: f64, slices: &mut Vec<Slice>) {
    let [[from, below_from], [to, below_to]] = line;
    let mut press =
        |y_mm, depth_mm| slices.push(Slice { x_mm, y_mm, weight_mm2: width_mm * depth_mm, slope_mm: 0.0 });
    let (least, most) = (below_from.min(below_to), below_from.max(below_to));
    press([from, to], least);
    if most - least > 1e-12 * most {
        let scale_mm = sigma_mm * (most - least) / (to - from);
        for (below, thickness_mm) in smooth(least, most, scale_mm) {
            let end = from + (to - from) * (below - below_from) / (below_to - below_from);
            let layer = if below_to > below_from { [end, to] } else { [from, end] };
            press(layer, thickness_mm);
        }
    }
}

#[cfg(test)]
#[path = "contact_tests.rs"]
mod tests;
