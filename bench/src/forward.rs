//! Images per second along one way, and their error.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use tactus_model::Array;

use crate::clock::paint;
use crate::{Painter, Tool, Way, model, poses};

/// Poses of a throughput run: too many for a branch predictor to learn.
const POSES: u32 = 4096;

/// One measurement.
#[derive(Debug, Clone)]
pub struct Forward {
    /// Array to press.
    pub array: Array,
    /// Tool that presses.
    pub tool: Tool,
    /// Way from pose to image.
    pub way: Way,
    /// Number of threads.
    pub threads: usize,
    /// Time to prepare everything that does not depend on the pose.
    pub ready_s: f64,
    /// Rate of all threads together.
    pub images_per_s: f64,
    /// Greatest difference of an element from the exact image, as a share of that image's peak; `None` if no image was
    /// compared.
    pub error: Option<f64>,
}

impl Forward {
    /// Makes images for `time`, and compares `compared` images with the exact ones.
    ///
    /// # Errors
    /// If the way does not exist for this array.
    pub fn measure(
        array: &Array,
        tool: Tool,
        way: Way,
        threads: usize,
        time: Duration,
        compared: u32,
    ) -> Result<Self> {
        let model = model(array.clone())?;
        let indenter = tool.indenter();
        let started = Instant::now();
        let painter = Painter::new(way, &model, &indenter)?;
        let ready_s = started.elapsed().as_secs_f64();
        let exact = Painter::new(Way::Exact, &model, &indenter)?;
        Ok(Self {
            array: array.clone(),
            tool,
            way,
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
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().map(|worker| worker.join().map_err(|_| anyhow!("a thread panicked"))?).sum()
    })
}

fn error(mut painter: Painter, mut exact: Painter, array: &Array, compared: u32) -> Result<Option<f64>> {
    let mut got = vec![0.0; array.elements()];
    let mut want = got.clone();
    let mut worst: Option<f32> = None;
    for pose in poses(array, compared) {
        painter.image(&pose, &mut got)?;
        exact.image(&pose, &mut want)?;
        let peak = want.iter().copied().fold(0.0, f32::max);
        let off = got.iter().zip(&want).map(|(got, want)| (got - want).abs()).fold(0.0, f32::max);
        worst = Some(worst.unwrap_or(0.0).max(off / peak));
    }
    Ok(worst.map(f64::from))
}
