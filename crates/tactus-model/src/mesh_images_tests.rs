use super::*;
use crate::fixtures::{block, rotation};
use crate::{Array, Contact, Indenter, Psf, Response};

const COVERING: Covering = Covering { thickness_mm: 1.016 };

fn model(array: Array, psf: Psf) -> ForwardModel {
    let elements = array.elements();
    let quadratic_per_mm = vec![0.05; elements];
    let response = Response { quadratic_per_mm, ..Response::uniform(elements, 1000.0, 100.0) };
    ForwardModel::new(array, psf, response).unwrap()
}

fn mesh() -> Arc<Mesh> {
    Arc::new(block([3.0, 4.0, 5.0]))
}

#[test]
fn they_agree_with_the_exact_image() {
    let one_pitch = |array: Array| {
        let psf = Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 };
        model(array, psf)
    };
    for model in [model(Array::digitacts(), Psf::PAPER), one_pitch(Array::fingertip())] {
        let mesh = mesh();
        let mut images = MeshImages::new(&model, Arc::clone(&mesh), COVERING).unwrap();
        let elements = model.array().elements();
        let (mut exact, mut counts) = (vec![0.0; elements], vec![0.0; elements]);
        let (mut worst, mut peak) = (0.0_f64, 0.0_f64);
        for pose in 0..24_usize {
            let share = |step: f64| (pose as f64 * step).fract();
            let tilt_deg = [0.0, 1.0, 8.0, 70.0][pose % 4];
            let attitude =
                rotation([360.0 * share(0.618), tilt_deg * share(0.414), -tilt_deg * share(0.281)]);
            let extent_mm = model.array().extent_mm();
            let place = |axis: usize, step: f64| {
                let [least, most] = extent_mm[axis];
                least + (most - least) * share(step)
            };
            let position_mm = [place(0, 0.731), place(1, 0.553)];
            // Also beyond the covering.
            let depth_mm = 0.05 + 1.2 * share(0.367);
            assert!(images.image(position_mm, attitude, depth_mm, &mut counts));
            let indenter = Indenter::Mesh(Arc::new(mesh.turned(attitude).unwrap()));
            model.image(
                &Contact { indenter, position_mm, rotation_deg: 0.0, depth_mm },
                COVERING,
                &mut exact,
            );
            for (got, want) in counts.iter().zip(&exact) {
                worst = worst.max((f64::from(*got) - want).abs());
                peak = peak.max(want - 100.0);
            }
        }
        assert!(worst < 3e-4 * peak, "{}: {:.1e}", model.array().name(), worst / peak);
    }
}

#[test]
fn a_tool_above_the_surface_or_far_away_leaves_the_baseline() {
    let model = model(Array::digitacts(), Psf::PAPER);
    let mut images = MeshImages::new(&model, mesh(), COVERING).unwrap();
    let upright = rotation([0.0; 3]);
    for (x, depth_mm) in [(5.0, 0.0), (5.0, -1.0), (300.0, 0.5), (-300.0, 0.5)] {
        let mut counts = vec![0.0; 48];
        assert!(images.image([x, 5.0], upright, depth_mm, &mut counts));
        assert!(counts.iter().all(|count| (count - 100.0).abs() < 1e-3), "{x} {depth_mm}: {counts:?}");
    }
}

#[test]
fn a_copy_makes_the_same_images() {
    let model = model(Array::digitacts(), Psf::PAPER);
    let mut images = MeshImages::new(&model, mesh(), COVERING).unwrap();
    let (mut one, mut other) = (vec![0.0; 48], vec![0.0; 48]);
    let tilted = rotation([20.0, 3.0, -2.0]);
    images.image([8.0, 6.0], tilted, 0.4, &mut one);
    images.clone().image([8.0, 6.0], tilted, 0.4, &mut other);
    assert_eq!(one, other);
}

#[test]
fn an_open_mesh_has_none() {
    let square = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let mesh = Arc::new(Mesh::new(&square, &[[0, 1, 2], [0, 2, 3]]).unwrap());
    assert!(MeshImages::new(&model(Array::digitacts(), Psf::PAPER), mesh, COVERING).is_none());
}
