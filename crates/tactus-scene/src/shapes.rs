//! Generated tools in the tool's frame: z is up, the lowest point is at z = 0, and the middle of the extent is at
//! x = y = 0. All lengths are in mm.

use tactus_model::Mesh;

mod outline;
mod surface;

pub use surface::Surface;

use outline::{Outline, arc, polar};
use surface::{ellipsoid, extrude, revolve};

/// The three tools of the paper's images (Fig. 8 to 10).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scene {
    /// The block letter: [`h`].
    H,
    /// The open-ended wrench: [`wrench`].
    Wrench,
    /// The starship: [`spaceship`].
    Spaceship,
}

/// Every scene, in the order of the paper's Fig. 10.
pub const SCENES: [Scene; 3] = [Scene::H, Scene::Wrench, Scene::Spaceship];

impl Scene {
    /// `h`, `wrench` or `spaceship`.
    pub fn name(self) -> &'static str {
        match self {
            Self::H => "h",
            Self::Wrench => "wrench",
            Self::Spaceship => "spaceship",
        }
    }

    /// The scene with this name, in lower case.
    pub fn named(name: &str) -> Option<Self> {
        SCENES.into_iter().find(|scene| scene.name() == name)
    }

    /// The closed surface of its tool.
    pub fn surface(self) -> Surface {
        match self {
            Self::H => h(),
            Self::Wrench => wrench(),
            Self::Spaceship => spaceship(),
        }
    }

    /// Its tool, as the model takes it.
    #[expect(
        clippy::missing_panics_doc,
        clippy::expect_used,
        reason = "three fixed shapes, each made in a test"
    )]
    pub fn mesh(self) -> Mesh {
        let surface = self.surface();
        Mesh::new(surface.vertices_mm(), surface.triangles()).expect("a made shape is a tool")
    }
}

/// The block letter H, the paper's indenter (Fig. 9): 8 by 10, strokes 2 wide and along y, 10 tall.
pub fn h() -> Surface {
    let right = [[2.0, -1.0], [2.0, -5.0], [4.0, -5.0], [4.0, 5.0], [2.0, 5.0], [2.0, 1.0]];
    let left = right.map(|[x, y]| [-x, -y]);
    extrude(&[right, left].concat(), &[], [0.0, 10.0]).placed()
}

/// A small wrench along y, 15 long and 2 tall: a jaw, slanted by 15 degrees, at the end with greater y, and a ring with a
/// hexagonal hole at the other end.
pub fn wrench() -> Surface {
    const HANDLE: f64 = 0.9;
    const RING: f64 = 2.6;
    const HEAD: f64 = 3.2;
    const SLOT: f64 = 1.3;
    const SLANT_DEG: f64 = 15.0;
    let ring = [0.0, -4.9];
    let head = [0.0, 4.3];

    // Angles at which the handle meets the ring and the head, and the slot meets the head's rim.
    let at_ring_deg = libm::asin(HANDLE / RING).to_degrees();
    let at_head_deg = libm::asin(HANDLE / HEAD).to_degrees();
    let at_slot_deg = libm::asin(SLOT / HEAD).to_degrees();
    let open_deg = 90.0 + SLANT_DEG;

    let in_slot = |x: f64, y: f64| {
        let [right, up] = [polar(head, x, SLANT_DEG), polar([0.0, 0.0], y, open_deg)];
        [right[0] + up[0], right[1] + up[1]]
    };
    let outer: Outline = [
        arc(ring, RING, [90.0 + at_ring_deg, 450.0 - at_ring_deg], 32),
        arc(head, HEAD, [at_head_deg - 90.0, open_deg - at_slot_deg], 20),
        vec![in_slot(SLOT, -0.3), in_slot(0.0, -1.05), in_slot(-SLOT, -0.3)],
        arc(head, HEAD, [open_deg + at_slot_deg, 270.0 - at_head_deg], 16),
    ]
    .concat();
    let hexagon = arc(ring, 1.5, [330.0, 30.0], 5);
    extrude(&outer, &hexagon, [0.0, 2.0]).placed()
}

/// A small starship, 14 long and 10 wide: a flattened hull on a keel, low swept wings with an engine at either tip, and
/// canards behind the bow, which points along y. The lowest points of keel, engines, hull and wings are at different
/// heights.
pub fn spaceship() -> Surface {
    // Profiles are radii along the axis, stern to bow.
    let hull = [
        [0.0, -4.4],
        [0.9, -4.8],
        [1.15, -4.3],
        [1.55, -2.8],
        [1.8, -0.8],
        [1.75, 1.2],
        [1.45, 3.2],
        [0.95, 5.4],
        [0.45, 7.1],
        [0.0, 8.3],
    ];
    let engine = [
        [0.0, -4.6],
        [0.6, -5.6],
        [0.75, -5.6],
        [0.55, -4.9],
        [0.8, -4.3],
        [0.8, -1.2],
        [0.6, 0.0],
        [0.3, 0.7],
        [0.0, 0.9],
    ];
    let along_y = |profile: &[[f64; 2]], sides| revolve(profile, sides).map(|[x, y, z]| [x, z, -y]);
    let wing = vec![[0.8, -3.9], [4.2, -4.3], [4.2, -2.1], [1.2, 0.9]];
    let canard = vec![[0.6, 3.0], [2.7, 2.3], [2.7, 2.8], [0.6, 4.4]];
    let fin = vec![[-4.6, 0.5], [-2.2, 0.5], [-4.0, 1.9], [-4.9, 1.9]];

    let mirrored = |outline: &Outline| -> Outline { outline.iter().rev().map(|[x, y]| [-x, *y]).collect() };
    let both_wings = [wing.clone(), mirrored(&wing)].map(|wing| extrude(&wing, &[], [-0.6, -0.2]));
    let both_canards = [canard.clone(), mirrored(&canard)].map(|fore| extrude(&fore, &[], [-0.5, -0.2]));
    let both_engines = [-4.2, 4.2].map(|x| along_y(&engine, 20).moved([x, 0.0, -0.3]));

    let parts = [
        along_y(&hull, 28).map(|[x, y, z]| [x, y, 0.55 * z]),
        ellipsoid([0.7, 2.2, 0.6]).moved([0.0, -0.8, -0.7]),
        ellipsoid([0.6, 1.3, 0.5]).moved([0.0, 2.8, 0.6]),
        // The outline lies in the plane x = 0.
        extrude(&fin, &[], [-0.12, 0.12]).map(|[x, y, z]| [z, x, y]),
    ];
    let parts = parts.into_iter().chain(both_wings).chain(both_canards).chain(both_engines);
    Surface::of(parts).placed()
}

#[cfg(test)]
#[path = "shapes_tests.rs"]
mod tests;
