//! Rendered images against the exact ones, for chosen poses.
//!
//! `cargo test --release -p tactus-scene --test it -- --nocapture accuracy` prints the differences.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::Arc;

use tactus_model::{Array, Contact, Covering, ForwardModel, Indenter, Mesh, Psf, Response};
use tactus_scene::shapes::SCENES;
use tactus_scene::{Attitude, Pose, Renderer};

const COVERING: Covering = Covering { thickness_mm: 1.016 };

/// Holds for these poses; `random_poses` checks the bound that [`Renderer`] states for all.
const TOLERANCE: f64 = 1e-3;

/// The paper's `sigma` for the `DigiTacts` and one pitch for the other arrays (Fig. 10).
fn model(array: Array) -> ForwardModel {
    let response = Response::uniform(array.elements(), 1000.0, 0.0);
    let psf = match array.name() {
        "digitacts" => Psf::PAPER,
        _ => Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 },
    };
    ForwardModel::new(array, psf, response).unwrap()
}

fn middle_mm(array: &Array) -> [f64; 2] {
    array.extent_mm().map(|[least, most]| f64::midpoint(least, most))
}

fn exact(
    model: &ForwardModel,
    indenter: Indenter,
    position_mm: [f64; 2],
    rotation_deg: f64,
    depth_mm: f64,
) -> Vec<f64> {
    let mut counts = vec![0.0; model.array().elements()];
    model.image(&Contact { indenter, position_mm, rotation_deg, depth_mm }, COVERING, &mut counts);
    counts
}

/// Greatest difference of a pose's image from the exact one, relative to its peak.
fn error(renderer: &Renderer, pose: &Pose, exact: &[f64]) -> f64 {
    let mut counts = vec![0.0; exact.len()];
    renderer.raster_images(std::slice::from_ref(pose), &mut counts).unwrap();
    let peak = exact.iter().copied().fold(0.0, f64::max);
    exact.iter().zip(&counts).map(|(exact, count)| (exact - f64::from(*count)).abs()).fold(0.0, f64::max)
        / peak
}

#[test]
fn scenes_agree_with_the_exact_cut_on_every_array() {
    for array in Array::shipped() {
        for scene in SCENES {
            // The exact cut of many triangles under a narrow blur takes its time.
            let yaws_deg: &[f64] = if cfg!(debug_assertions) { &[10.0] } else { &[0.0, 10.0, 45.0, 137.0] };
            let mesh = Arc::new(scene.mesh());
            let model = model(array.clone());
            let [x, y] = middle_mm(&array);
            let renderer = Renderer::new(model.clone(), COVERING, Arc::clone(&mesh)).unwrap();
            let mut worst: f64 = 0.0;
            for (&yaw_deg, (dx, dy, depth_mm)) in
                yaws_deg.iter().zip([(0.0, 0.0, 0.6), (0.37, -0.51, 0.3), (-1.3, 0.9, 1.5), (2.1, 0.4, 0.6)])
            {
                let pose =
                    Pose { position_mm: [x + dx, y + dy], attitude: Attitude::upright(yaw_deg), depth_mm };
                let indenter = Indenter::Mesh(Arc::clone(&mesh));
                let exact = exact(&model, indenter, pose.position_mm, yaw_deg, depth_mm);
                worst = worst.max(error(&renderer, &pose, &exact));
            }
            println!(
                "{} under {}, cells of {:.3} mm: {worst:.1e}",
                scene.name(),
                array.name(),
                renderer.cell_mm()
            );
            assert!(worst < TOLERANCE, "{} under {}: {worst:e}", scene.name(), array.name());
        }
    }
}

/// A frustum of four sides, whose lower face is smaller: no side is upright, so that it has all of them at any tilt.
fn frustum() -> Mesh {
    let square = |half: f64, z: f64| [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]];
    let vertices_mm = [square(1.5, 0.0), square(2.5, 4.0)].concat();
    let sides = (0..4u32).flat_map(|k| [[k, (k + 1) % 4, 4 + k], [(k + 1) % 4, 4 + (k + 1) % 4, 4 + k]]);
    let ends = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    Mesh::new(&vertices_mm, &ends.into_iter().chain(sides).collect::<Vec<_>>()).unwrap()
}

#[test]
fn a_tilted_tool_agrees_with_the_exact_cut_of_the_turned_mesh() {
    let array = Array::digitacts();
    let model = model(array.clone());
    let position_mm = middle_mm(&array);
    let renderer = Renderer::new(model.clone(), COVERING, Arc::new(frustum())).unwrap();
    for (yaw_deg, pitch_deg, roll_deg, depth_mm) in
        [(0.0, 5.0, 0.0, 0.5), (30.0, -3.0, 8.0, 0.9), (77.0, 50.0, 20.0, 0.7), (10.0, 180.0, 3.0, 1.4)]
    {
        let attitude = Attitude { yaw_deg, pitch_deg, roll_deg };
        let turned = frustum().turned(attitude.matrix()).unwrap();
        let exact = exact(&model, Indenter::Mesh(Arc::new(turned)), position_mm, 0.0, depth_mm);
        let error = error(&renderer, &Pose { position_mm, attitude, depth_mm }, &exact);
        println!("frustum, {attitude:?}: {error:.1e}");
        assert!(error < TOLERANCE, "{attitude:?}: {error:e}");
    }
}

#[test]
fn a_box_of_triangles_presses_as_a_box() {
    let array = Array::digitacts();
    let model = model(array.clone());
    let vertices_mm = [[-1.0, -1.5, 0.0], [1.0, -1.5, 0.0], [1.0, 1.5, 0.0], [-1.0, 1.5, 0.0]];
    let mesh = Mesh::new(&vertices_mm, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let renderer = Renderer::new(model.clone(), COVERING, Arc::new(mesh)).unwrap();
    let [x, y] = middle_mm(&array);
    for (yaw_deg, dx) in [(0.0, 0.0), (0.0, 0.123), (20.0, 0.0), (45.0, 1.9), (90.0, 14.0)] {
        let position_mm = [x + dx, y];
        let exact = exact(&model, Indenter::Box { size_mm: [2.0, 3.0] }, position_mm, yaw_deg, 0.6);
        let pose = Pose { position_mm, attitude: Attitude::upright(yaw_deg), depth_mm: 0.6 };
        let error = error(&renderer, &pose, &exact);
        println!("box, {yaw_deg} deg, {dx} mm: {error:.1e}");
        assert!(error < TOLERANCE, "{yaw_deg} deg, {dx} mm: {error:e}");
    }
}

#[test]
fn the_error_falls_nearly_with_the_square_of_the_cells() {
    let array = Array::digitacts();
    let model = model(array.clone());
    let mesh = Arc::new(SCENES[0].mesh());
    let position_mm = middle_mm(&array);
    let poses = [3.0, 10.0, 28.0, 45.0, 61.0, 90.0].map(|yaw_deg: f64| {
        let pose = Pose { position_mm, attitude: Attitude::upright(yaw_deg), depth_mm: 0.6 };
        let exact = exact(&model, Indenter::Mesh(Arc::clone(&mesh)), position_mm, yaw_deg, 0.6);
        (pose, exact)
    });
    let errors = [0.68, 0.34, 0.17, 0.085].map(|cell_mm| {
        let renderer = Renderer::with_cell_mm(model.clone(), COVERING, Arc::clone(&mesh), cell_mm).unwrap();
        let squares = poses.iter().map(|(pose, exact)| error(&renderer, pose, exact).powi(2));
        let rms = (squares.sum::<f64>() / poses.len() as f64).sqrt();
        println!("H, cells of {cell_mm} mm: {rms:.1e}");
        rms
    });
    let order = (errors[0] / errors[3]).log2() / 3.0;
    println!("order {order:.2}");
    assert!(order > 1.5, "{order}");
}
