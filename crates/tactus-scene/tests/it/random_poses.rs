//! The image by the raster and that along outlines against the exact one over random poses of every made tool and of round ones.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tactus_model::{Array, Contact, Covering, ForwardModel, Indenter, Mesh, Psf, Response};
use tactus_scene::shapes::Scene;
use tactus_scene::{Attitude, Pose, Renderer};

/// Number of poses of each tool on each array, in the order of [`Array::shipped`]. The exact image of many triangles
/// under a narrow blur takes up to a second, so those combinations get few or none.
const POSES: [(Tool, [usize; 3]); 7] = [
    (Tool::Scene(Scene::H), [60, 12, 6]),
    (Tool::Scene(Scene::Wrench), [48, 3, 0]),
    (Tool::Scene(Scene::Spaceship), [6, 0, 0]),
    (Tool::Cylinder, [36, 3, 0]),
    (Tool::Sphere, [36, 3, 0]),
    (Tool::Cone, [36, 3, 0]),
    (Tool::Box, [60, 60, 30]),
];

/// For poses that touch at least this many cells: the share that may differ by more than 1e-3 of the peak. Two poses in
/// three are tilted, and most of those touch with an edge or a corner only.
const SHARE_OVER_MAX: [(usize, f64); 4] = [(0, 1.0), (10, 1.0), (100, 0.25), (1000, 0.03)];

/// Of a pose whose image is made along its outline.
const OUTLINE_ERROR_MAX: f64 = 1e-3;

#[derive(Debug, Clone, Copy)]
enum Tool {
    Scene(Scene),
    Cylinder,
    Sphere,
    Cone,
    Box,
}

struct Case {
    tool: Tool,
    model: ForwardModel,
    renderer: Renderer,
    covering: Covering,
    mesh: Arc<Mesh>,
    pose: Pose,
}

struct Found {
    /// Greatest difference of an element of the rastered image, relative to the image's peak.
    error: f64,
    /// The same of the image along outlines, where it is made so.
    outline_error: f64,
    /// What [`Renderer`] states for this pose.
    bound: f64,
    /// Cells that the tool touches.
    touched: usize,
    label: String,
}

#[test]
fn random_poses_agree_with_the_exact_image_within_the_stated_bound() {
    let cases = cases(7);
    let mut all: Vec<Found> = cases.par_iter().map(Case::compare).collect();
    all.sort_by(|one, other| other.error.total_cmp(&one.error));
    for Found { error, bound, label, .. } in all.iter().take(10) {
        println!("{error:.1e}, bound {bound:.1e}: {label}");
    }
    let most = all.iter().map(|found| found.error / found.bound).fold(0.0, f64::max);
    println!("{} poses, at most {most:.2} of the bound", all.len());
    for Found { error, bound, label, .. } in &all {
        assert!(error <= bound, "{error:e} exceeds {bound:e}: {label}");
    }
    let outlined = all.iter().filter(|found| found.outline_error > 0.0);
    println!("{} poses by their outline", outlined.clone().count());
    assert!(2 * outlined.clone().count() > all.len(), "most tools are closed");
    for Found { outline_error, label, .. } in outlined {
        assert!(*outline_error < OUTLINE_ERROR_MAX, "{outline_error:e} by its outline: {label}");
    }
    for (index, (least, share_over_max)) in SHARE_OVER_MAX.into_iter().enumerate() {
        let end = SHARE_OVER_MAX.get(index + 1).map_or(usize::MAX, |(next, _)| *next);
        let within = all.iter().filter(|found| (least..end).contains(&found.touched));
        let errors: Vec<f64> = within.map(|found| found.error).collect();
        let over = errors.iter().filter(|error| **error > 1e-3).count();
        println!("from {least} cells: {over} of {} poses over 1e-3, worst {:.1e}", errors.len(), errors[0]);
        assert!(over as f64 <= share_over_max * errors.len() as f64, "from {least} cells: {over} over 1e-3");
    }
}

fn cases(seed: u64) -> Vec<Case> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut cases = Vec::new();
    for (tool, counts) in POSES {
        let mesh = Arc::new(tool.mesh());
        for (array, count) in Array::shipped().into_iter().zip(counts) {
            cases.extend((0..count).map(|index| Case::random(tool, &mesh, &array, index, &mut rng)));
        }
    }
    cases
}

impl Case {
    /// Every third pose is upright, every third tilted by up to 10 degrees, every third in any attitude.
    fn random(tool: Tool, mesh: &Arc<Mesh>, array: &Array, index: usize, rng: &mut ChaCha8Rng) -> Self {
        let covering = Covering::PAPER[rng.random_range(0..Covering::PAPER.len())];
        let tilt_deg = [0.0, 10.0, 180.0][index % 3];
        let attitude = Attitude {
            yaw_deg: rng.random_range(0.0..360.0),
            pitch_deg: tilt_deg * rng.random_range(-1.0..1.0),
            roll_deg: tilt_deg * rng.random_range(-1.0..1.0),
        };
        // From 0.05 mm to beyond the covering's thickness, shallow ones as often as deep ones.
        let depth_mm = 0.05 * (1.2 * covering.thickness_mm / 0.05_f64).powf(rng.random_range(0.0..1.0));
        // Cells as on the whole array; a few elements suffice for the comparison.
        let cell_mm = Renderer::new(model(array), covering, Arc::clone(mesh)).unwrap().cell_mm();
        let model = model(&part(array));
        let renderer = Renderer::with_cell_mm(model.clone(), covering, Arc::clone(mesh), cell_mm).unwrap();
        // The tool's lowest point lies over the array.
        let rotation = attitude.matrix();
        let turned = mesh
            .vertices_mm()
            .iter()
            .map(|[u, v, w]| rotation.map(|[a, b, c]| a * u + b * v + c * w))
            .min_by(|one, other| one[2].total_cmp(&other[2]))
            .unwrap();
        let extent_mm = model.array().extent_mm();
        let position_mm =
            [0, 1].map(|axis| rng.random_range(extent_mm[axis][0]..extent_mm[axis][1]) - turned[axis]);
        let pose = Pose { position_mm, attitude, depth_mm };
        Self { tool, model, renderer, covering, mesh: Arc::clone(mesh), pose }
    }

    fn compare(&self) -> Found {
        let Self { tool, model, renderer, covering, mesh, pose } = self;
        let Pose { position_mm, attitude, depth_mm } = *pose;
        let indenter = Indenter::Mesh(Arc::new(mesh.turned(attitude.matrix()).unwrap()));
        let mut exact = vec![0.0; model.array().elements()];
        let contact = Contact { indenter, position_mm, rotation_deg: 0.0, depth_mm };
        model.image(&contact, *covering, &mut exact);
        let mut rendered = vec![0.0; exact.len()];
        renderer.raster_images(std::slice::from_ref(pose), &mut rendered).unwrap();
        let map = renderer.depth_map(pose).unwrap();

        let mut outlined = rendered.clone();
        renderer.image(pose, &mut outlined).unwrap();

        let peak = exact.iter().copied().fold(0.0, f64::max);
        let error = |image: &[f32]| {
            let differences = exact.iter().zip(image).map(|(exact, got)| (exact - f64::from(*got)).abs());
            differences.fold(0.0, f64::max) / peak
        };
        let is_outlined = outlined != rendered;
        let touched = map.penetration_mm.iter().filter(|depth_mm| **depth_mm > 0.0).count();
        let sigma_cells = model.psf().sigma_mm(*covering) / map.cell_mm;
        let cells = (touched.max(1) as f64).min(4.0 * PI * sigma_cells * sigma_cells);
        Found {
            error: error(&rendered),
            outline_error: if is_outlined { error(&outlined) } else { 0.0 },
            bound: 2.0 * cells.powf(-0.75),
            touched,
            label: format!(
                "{tool:?} on {} under {} mm, {pose:?}, {touched} cells of {:.3} mm touched",
                model.array().name(),
                covering.thickness_mm,
                map.cell_mm
            ),
        }
    }
}

/// The paper's `sigma` for the `DigiTacts` and one pitch for the other arrays (Fig. 10).
fn model(array: &Array) -> ForwardModel {
    let psf = match array.name() {
        "digitacts" => Psf::PAPER,
        _ => Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 },
    };
    ForwardModel::new(array.clone(), psf, Response::uniform(array.elements(), 1000.0, 0.0)).unwrap()
}

/// At most 6 by 6 elements of an array.
fn part(array: &Array) -> Array {
    let first = |centres_mm: &[f64]| centres_mm.iter().copied().take(6).collect();
    let (cols, rows) = (first(array.col_centres_mm()), first(array.row_centres_mm()));
    Array::new(array.name(), array.element_mm(), cols, rows, 30.0, 4095.0, 1.0).unwrap()
}

impl Tool {
    fn mesh(self) -> Mesh {
        let sphere = |ring: i32| {
            let (sin, cos) = (PI * (f64::from(ring) + 0.5) / 7.0 - PI / 2.0).sin_cos();
            [2.0 * cos, 2.0 + 2.0 * sin]
        };
        match self {
            Self::Scene(scene) => scene.mesh(),
            Self::Cylinder => revolved(&[[1.0, 0.0], [1.0, 5.0]], 16, 0.0),
            Self::Sphere => revolved(&(0..7).map(sphere).collect::<Vec<_>>(), 12, 0.0),
            Self::Cone => revolved(&[[1e-3, 0.0], [2.0, 2.0], [2.0, 5.0]], 16, 0.0),
            // Four sides around the axis; the corners of the square are 1.5 away.
            Self::Box => revolved(&[[1.5, 0.0], [1.5, 4.0]], 4, TAU / 8.0),
        }
    }
}

/// A closed solid of rings of this many sides; `profile` gives the radius and height of each ring in mm, bottom to top.
fn revolved(profile: &[[f64; 2]], sides: u32, start_rad: f64) -> Mesh {
    let rings = u32::try_from(profile.len()).unwrap();
    let around = |[radius, z]: &[f64; 2]| {
        let [radius, z] = [*radius, *z];
        (0..sides).map(move |side| {
            let (sin, cos) = (start_rad + TAU * f64::from(side) / f64::from(sides)).sin_cos();
            [radius * cos, radius * sin, z]
        })
    };
    let vertex = |ring: u32, side: u32| ring * sides + side % sides;
    let walls = (1..rings).flat_map(|ring| {
        (0..sides).flat_map(move |side| {
            let [a, b] = [vertex(ring - 1, side), vertex(ring - 1, side + 1)];
            let [c, d] = [vertex(ring, side), vertex(ring, side + 1)];
            [[a, b, c], [c, b, d]]
        })
    });
    let ends = [0, rings - 1].into_iter().flat_map(|ring| {
        (2..sides).map(move |side| [vertex(ring, 0), vertex(ring, side - 1), vertex(ring, side)])
    });
    let vertices_mm: Vec<_> = profile.iter().flat_map(around).collect();
    Mesh::new(&vertices_mm, &walls.chain(ends).collect::<Vec<_>>()).unwrap()
}
