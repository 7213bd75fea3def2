//! Times of images and of other work.

use std::hint::black_box;
use std::time::{Duration, Instant};

use anyhow::Result;
use tactus_model::Array;

use crate::{Painter, Pose, poses};

/// Time in s from a pose to its image: the median of five runs over the same poses, each of at least 0.05 s.
///
/// # Errors
/// If the painter refuses a pose.
pub fn per_image_s(painter: &mut Painter, array: &Array) -> Result<f64> {
    const RUNS: usize = 5;
    let poses = poses(array, 1024);
    let mut image = vec![0.0; array.elements()];
    let mut runs_s = Vec::with_capacity(RUNS);
    for _ in 0..RUNS {
        let (images, took) = paint(painter, &poses, &mut image, Duration::from_millis(50))?;
        runs_s.push(took.as_secs_f64() / images as f64);
    }
    runs_s.sort_by(f64::total_cmp);
    Ok(runs_s[RUNS / 2])
}

/// Makes images of the poses, cyclically, for at least some time; returns their number and the time taken.
pub(crate) fn paint(
    painter: &mut Painter,
    poses: &[Pose],
    image: &mut [f32],
    at_least: Duration,
) -> Result<(u64, Duration)> {
    let started = Instant::now();
    let mut images = 0;
    // Reading the clock takes some tens of nanoseconds, so it is read once for several images.
    for several in poses.chunks(16).cycle() {
        for pose in several {
            painter.image(black_box(pose), image)?;
            black_box(&mut *image);
        }
        images += several.len() as u64;
        if started.elapsed() >= at_least {
            break;
        }
    }
    Ok((images, started.elapsed()))
}

/// The result of the work, and the median of its times in s.
pub(crate) fn timed<T, E>(times: usize, mut work: impl FnMut() -> Result<T, E>) -> Result<(T, f64), E> {
    let mut once = || {
        let started = Instant::now();
        work().map(|done| (done, started.elapsed().as_secs_f64()))
    };
    let (done, first_s) = once()?;
    let mut took_s = vec![first_s];
    for _ in 1..times {
        took_s.push(once()?.1);
    }
    took_s.sort_unstable_by(f64::total_cmp);
    Ok((done, took_s[took_s.len() / 2]))
}
