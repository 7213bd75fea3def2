//! Images per second of the graphics processor: the H under the three shipped arrays.
//!
//! `cargo run --release -p tactus-scene --features gpu --example gpu_throughput -- [POSES [REPEATS]]`
#![allow(clippy::print_stdout, reason = "a program that prints a table")]

use std::{env, error::Error, sync::Arc, time::Instant};

use tactus_model::{Array, Covering, ForwardModel, Psf, Response};
use tactus_scene::shapes::Scene;
use tactus_scene::{Attitude, GpuRenderer, Pose, Renderer};

fn main() -> Result<(), Box<dyn Error>> {
    let numbers = env::args().skip(1).map(|number| number.parse());
    let numbers = numbers.collect::<Result<Vec<usize>, _>>()?;
    let poses = numbers.first().copied().unwrap_or(10_000);
    let repeats = numbers.get(1).copied().unwrap_or(3).max(1);
    let mesh = Arc::new(Scene::H.mesh());
    for array in Array::shipped() {
        let poses = poses_over(&array, poses);
        let mut counts = vec![0.0; poses.len() * array.elements()];
        let name = array.name().to_owned();
        let mut gpu = GpuRenderer::new(Renderer::new(model(array)?, COVERING, Arc::clone(&mesh))?)?;
        // Once for the buffers and the driver's compiler.
        gpu.images(&poses, &mut counts)?;
        let mut best_s = f64::INFINITY;
        for _ in 0..repeats {
            let start = Instant::now();
            gpu.images(&poses, &mut counts)?;
            best_s = best_s.min(start.elapsed().as_secs_f64());
        }
        println!(
            "{}, {name}: {:.0} images/s at {} poses",
            gpu.adapter(),
            poses.len() as f64 / best_s,
            poses.len()
        );
    }
    Ok(())
}

const COVERING: Covering = Covering { thickness_mm: 1.016 };

/// Spread by the paper's `sigma` under the `DigiTacts`, by one pitch under the others.
fn model(array: Array) -> Result<ForwardModel, Box<dyn Error>> {
    let response = Response::uniform(array.elements(), 1000.0, 100.0);
    let psf = match array.name() {
        "digitacts" => Psf::PAPER,
        _ => Psf { sigma_intercept_mm: array.pitch_mm(), sigma_per_mm: 0.0 },
    };
    Ok(ForwardModel::new(array, psf, response)?)
}

/// Places, attitudes and depths that differ from pose to pose.
fn poses_over(array: &Array, poses: usize) -> Vec<Pose> {
    let [x, y] = array.extent_mm().map(|[least, most]| f64::midpoint(least, most));
    let pose = |index: usize| {
        let at = index as f64;
        let attitude =
            Attitude { yaw_deg: 7.3 * at, pitch_deg: (0.9 * at).sin(), roll_deg: (1.3 * at).sin() };
        let position_mm = [x + 2.0 * (0.37 * at).sin(), y + 2.0 * (0.71 * at).sin()];
        Pose { position_mm, attitude, depth_mm: 0.6 + 0.3 * (0.53 * at).sin() }
    };
    (0..poses).map(pose).collect()
}
