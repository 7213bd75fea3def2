//! Images a second along one way, and how far it is from exact.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use tactus_model::Array;

use crate::clock::paint;
use crate::{Painter, Tool, Way, model, poses};

/// Poses of a throughput run: more than a branch predictor learns by heart.
const POSES: u32 = 4096;

/// One measurement.
#[derive(Debug, Clone)]
pub struct Forward {
    /// Which array.
    pub array: Array,
    /// Which tool.
    pub tool: Tool,
    /// Which way.
    pub way: Way,
    /// How many at once.
    pub threads: usize,
    /// Seconds to make ready what no pose changes.
    pub ready_s: f64,
    /// All threads together.
    pub images_per_s: f64,
    /// Greatest difference of an element to the exact image over the poses compared, as a share of that image's
    /// peak; none if none was compared.
    pub error: Option<f64>,
}

impl Forward {
    /// Presses for a while, and holds so many images against the exact ones.
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
        workers.into_iter().map(|worker| worker.join().map_err(|_| anyhow!("a thread fell over"))?).sum()
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
