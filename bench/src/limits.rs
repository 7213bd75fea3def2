//! Limits of this machine, and how much of them the kernels use.

use std::hint::black_box;
use std::time::Instant;

use anyhow::Result;
use tactus_model::Array;

use crate::{Method, Painter, Tool, model, per_image_s, poses};

/// Rates of one core, and the work of the kernels.
///
/// For each element that the tool reaches, with `C` channels (1 for the cylinder, 3 for the H: the nodes of its
/// rotation), the press table takes:
///
/// ```text
/// flops = 32 C (4 x 4 nodes, a multiplication and an addition each) + 12 C (weights along x) + 41 (place, spline
///         weights, response)
/// bytes = 64 C (4 x 4 nodes) + 20 (centre, response) + 4 (the count)
/// ```
///
/// There is no such formula for the exact method, which spends its time in `erfc` and `exp`.
#[derive(Debug, Clone)]
pub struct MachineLimits {
    /// Single-precision operations, where a multiplication and an addition count as two, with the vector width and the
    /// instructions that this program is compiled for.
    pub flops_per_s: f64,
    /// Reading from the first cache, the second cache and memory.
    pub bytes_per_s: [f64; 3],
    /// The measured kernels.
    pub kernels: Vec<Kernel>,
}

/// One kernel on one array.
#[derive(Debug, Clone)]
pub struct Kernel {
    /// Name of the array.
    pub array: String,
    /// Tool that presses.
    pub tool: Tool,
    /// Floating-point operations of an image.
    pub flops: f64,
    /// Bytes that an image reads and writes.
    pub bytes: f64,
    /// Time of an image.
    pub image_s: f64,
}

/// Numbers that fill half of the first cache, half of the second cache, and more than any cache.
const PLACES: [usize; 3] = [4 << 10, 128 << 10, 64 << 20];

impl MachineLimits {
    /// Measures the machine and the kernels.
    ///
    /// # Errors
    /// If an image cannot be made.
    pub fn measure() -> Result<Self> {
        let mut kernels = Vec::new();
        for array in Array::shipped() {
            for tool in [Tool::H, Tool::Cylinder] {
                kernels.push(Kernel::of_press_table(&array, tool)?);
            }
        }
        Ok(Self { flops_per_s: flops_per_s(), bytes_per_s: PLACES.map(bytes_per_s), kernels })
    }
}

impl Kernel {
    fn of_press_table(array: &Array, tool: Tool) -> Result<Self> {
        let mut painter = Painter::new(Method::PressTable, &model(array.clone())?, &tool.indenter())?;
        let channels = match tool {
            Tool::H | Tool::TiltedH => 3.0,
            Tool::Cylinder => 1.0,
        };
        let reached = reached(&mut painter, array)?;
        Ok(Self {
            array: array.name().into(),
            tool,
            flops: reached * (44.0 * channels + 41.0),
            bytes: reached * (64.0 * channels + 24.0),
            image_s: per_image_s(&mut painter, array)?,
        })
    }
}

/// Elements that a tool reaches, on average.
fn reached(painter: &mut Painter, array: &Array) -> Result<f64> {
    let mut image = vec![0.0; array.elements()];
    let poses = poses(array, 256);
    let mut reached = 0;
    for pose in &poses {
        painter.image(pose, &mut image)?;
        reached += image.iter().filter(|count| count.abs() > 0.0).count();
    }
    Ok(reached as f64 / poses.len() as f64)
}

/// Numbers in a vector register.
const LANES: usize = if cfg!(target_feature = "avx512f") {
    16
} else if cfg!(target_feature = "avx") {
    8
} else {
    4
};

/// Measured with chains of operations that do not wait for each other: enough to keep the units busy, and few enough for the
/// registers.
fn flops_per_s() -> f64 {
    const CHAINS: usize = 12;
    const ROUNDS: u32 = 1_000_000;
    let round = || {
        let (factor, offset) = (black_box(0.999_f32), black_box(0.001_f32));
        let mut sums = [[1.0_f32; LANES]; CHAINS];
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = sum.map(|lane| lane * factor + offset);
            }
        }
        black_box(sums);
    };
    2.0 * f64::from(ROUNDS) * (LANES * CHAINS) as f64 / least_s(round)
}

/// Measured by adding up a list, repeatedly if it is short.
fn bytes_per_s(places: usize) -> f64 {
    /// Parallel sums; enough to hide the latency of an addition.
    const SUMS: usize = 64;
    let list = vec![1_u32; places];
    let rounds = (PLACES[2] / places).max(1);
    let round = || {
        for _ in 0..rounds {
            let mut sums = [0_u32; SUMS];
            for several in black_box(&list).chunks_exact(SUMS) {
                for (sum, one) in sums.iter_mut().zip(several) {
                    *sum = sum.wrapping_add(*one);
                }
            }
            black_box(sums);
        }
    };
    (rounds * places * size_of::<u32>()) as f64 / least_s(round)
}

/// The least of several times, since a disturbance only adds time.
fn least_s(work: impl Fn()) -> f64 {
    let time_s = |_| {
        let started = Instant::now();
        work();
        started.elapsed().as_secs_f64()
    };
    (0..10).map(time_s).fold(f64::INFINITY, f64::min)
}
