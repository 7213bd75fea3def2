//! Images per second by one method, and their error.

use std::time::{Duration, Instant};

use anyhow::Result;
use rayon::ThreadPoolBuilder;
use tactus_model::Array;

use crate::clock::paint;
use crate::{Method, Painter, Tool, model, poses};

/// Poses of a throughput run: too many for a branch predictor to learn.
const POSES: u32 = 4096;

/// One measurement.
#[derive(Debug, Clone)]
pub struct Forward {
    /// Array to press.
    pub array: Array,
    /// Tool that presses.
    pub tool: Tool,
    /// Method from pose to image.
    pub method: Method,
    /// Number of threads.
    pub threads: usize,
    /// Time to prepare everything that does not depend on the pose.
    pub ready_s: f64,
    /// Rate of all threads together.
    pub images_per_s: f64,
    /// Greatest difference of an element from the exact image, as a share of the greatest peak of those images; `None` if none was
    /// compared.
    pub error: Option<f64>,
}

impl Forward {
    /// Makes images for `time`, and compares `compared` images with the exact ones.
    ///
    /// # Errors
    /// If the method does not exist for this array.
    pub fn measure(
        array: &Array,
        tool: Tool,
        method: Method,
        threads: usize,
        time: Duration,
        compared: u32,
    ) -> Result<Self> {
        let model = model(array.clone())?;
        let indenter = tool.indenter();
        let started = Instant::now();
        let painter = Painter::new(method, &model, &indenter)?;
        let ready_s = started.elapsed().as_secs_f64();
        let exact = Painter::new(Method::Exact, &model, &indenter)?;
        Ok(Self {
            array: array.clone(),
            tool,
            method,
            threads,
            ready_s,
            images_per_s: images_per_s(&painter, array, threads, time)?,
            error: error(painter, exact, array, compared)?,
        })
    }
}

fn images_per_s(painter: &Painter, array: &Array, threads: usize, time: Duration) -> Result<f64> {
    let poses = poses(array, POSES);
    let work = || {
        let mut painter = painter.clone();
        let mut image = vec![0.0; array.elements()];
        let (images, took) = paint(&mut painter, &poses, &mut image, time)?;
        Ok(images as f64 / took.as_secs_f64())
    };
    let pool = ThreadPoolBuilder::new().num_threads(threads.max(1)).build()?;
    pool.broadcast(|_| work()).into_iter().sum()
}

fn error(mut painter: Painter, mut exact: Painter, array: &Array, compared: u32) -> Result<Option<f64>> {
    let mut got = vec![0.0; array.elements()];
    let mut want = got.clone();
    let (mut worst, mut highest) = (0.0_f32, 0.0_f32);
    for pose in poses(array, compared) {
        painter.image(&pose, &mut got)?;
        exact.image(&pose, &mut want)?;
        let peak = want.iter().copied().fold(0.0, f32::max);
        let off = got.iter().zip(&want).map(|(got, want)| (got - want).abs()).fold(0.0, f32::max);
        (worst, highest) = (worst.max(off), highest.max(peak));
    }
    Ok((highest > 0.0).then(|| f64::from(worst / highest)))
}
