//! The shaders against the processor. On a machine without a Vulkan driver these tests fail, and say so.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::Arc;

use tactus_model::{Array, Covering, ForwardModel, Mesh, Psf, Response};
use tactus_scene::shapes::SCENES;
use tactus_scene::{Attitude, GpuError, GpuRenderer, Pose, RenderError, Renderer};

const COVERING: Covering = Covering { thickness_mm: 1.016 };

/// Greatest difference of the two, relative to the greatest rise above the baseline; measured: 1.3e-6.
const TOLERANCE: f32 = 1e-5;

const BASELINE: f32 = 100.0;

/// A blur of one pitch.
fn renderer(array: Array, mesh: Mesh) -> Renderer {
    let elements = array.elements();
    let response = Response {
        sensitivity_counts_per_mm: (0..elements).map(|element| 900.0 + element as f64).collect(),
        quadratic_per_mm: vec![0.05; elements],
        ..Response::uniform(elements, 1000.0, BASELINE.into())
    };
    let psf = Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 };
    Renderer::new(ForwardModel::new(array, psf, response).unwrap(), COVERING, Arc::new(mesh)).unwrap()
}

/// Upright and tilted, shallow and deeper than the covering, within the array and beside it.
fn poses(array: &Array) -> Vec<Pose> {
    let [[left, right], [front, back]] = array.extent_mm();
    let [x, y] = [f64::midpoint(left, right), f64::midpoint(front, back)];
    let tilts = [(0.0, 0.0), (4.0, 0.0), (-7.0, 3.0), (31.0, -64.0)];
    let places = [[x, y], [x + 0.37, y - 0.91], [left, back + 1.0]];
    let mut poses = Vec::new();
    for (pitch_deg, roll_deg) in tilts {
        for yaw_deg in [0.0, 10.0, 45.0, 163.0] {
            for (position_mm, depth_mm) in places.into_iter().zip([0.3, 0.7, 2.5]) {
                poses.push(Pose {
                    position_mm,
                    attitude: Attitude { yaw_deg, pitch_deg, roll_deg },
                    depth_mm,
                });
            }
        }
    }
    poses
}

fn greatest_difference(one: &[f32], other: &[f32]) -> f32 {
    let peak = one.iter().map(|count| (count - BASELINE).abs()).fold(0.0, f32::max);
    one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / peak
}

#[test]
fn shaders_and_processor_make_the_same_images() {
    for array in Array::shipped() {
        for scene in SCENES {
            let renderer = renderer(array.clone(), scene.mesh());
            let elements = array.elements();
            let poses = poses(&array);
            let mut expected = vec![0.0; poses.len() * elements];
            renderer.raster_images(&poses, &mut expected).unwrap();
            let mut gpu = GpuRenderer::new(renderer).unwrap();
            let mut counts = vec![0.0; expected.len()];
            gpu.images(&poses, &mut counts).unwrap();
            let pairs = expected.chunks(elements).zip(counts.chunks(elements));
            let worst = pairs.map(|(one, other)| greatest_difference(one, other)).fold(0.0, f32::max);
            println!("{} under {}, {}: {worst:.1e}", scene.name(), array.name(), gpu.adapter());
            assert!(worst < TOLERANCE, "{} under {}: {worst:e}", scene.name(), array.name());
        }
    }
}

#[test]
fn a_batch_of_any_size_equals_its_single_images() {
    let array = Array::digitacts();
    let elements = array.elements();
    let mut gpu = GpuRenderer::new(renderer(array.clone(), SCENES[0].mesh())).unwrap();
    let few = poses(&array);
    // More than the buffers of two batches hold.
    let many: Vec<Pose> = few.iter().cycle().take(4_500).copied().collect();
    let mut batch = vec![0.0; many.len() * elements];
    gpu.images(&many, &mut batch).unwrap();
    for (pose, image) in few.iter().zip(batch.chunks(elements)) {
        let mut single = vec![0.0; elements];
        gpu.images(&[*pose], &mut single).unwrap();
        assert_eq!(single, image);
    }
    for (place, image) in batch.chunks(elements).enumerate() {
        assert_eq!(image, &batch[place % few.len() * elements..][..elements], "image {place}");
    }
}

#[test]
fn a_tool_that_does_not_press_leaves_the_baseline() {
    let array = Array::digitacts();
    let mut gpu = GpuRenderer::new(renderer(array.clone(), SCENES[0].mesh())).unwrap();
    let mut pose = poses(&array)[0];
    pose.depth_mm = 0.0;
    let mut counts = vec![0.0; array.elements()];
    gpu.images(&[pose], &mut counts).unwrap();
    assert_eq!(counts, vec![BASELINE; array.elements()]);
    gpu.images(&[], &mut []).unwrap();
}

#[test]
fn a_pose_that_is_no_number_is_refused() {
    let array = Array::digitacts();
    let mut gpu = GpuRenderer::new(renderer(array.clone(), SCENES[0].mesh())).unwrap();
    let mut pose = poses(&array)[0];
    pose.attitude.yaw_deg = f64::NAN;
    let error = gpu.images(&[pose], &mut vec![0.0; array.elements()]).unwrap_err();
    assert!(matches!(error, GpuError::Render(RenderError::Pose { pose: 0, field: "attitude" })));
}
