//! The finite element model of the covering: the time of one solution, and the reactions.

use std::hint::black_box;
use std::time::Instant;

use anyhow::Result;
use tactus_solid::fem::{Bricks, Reaction};

/// Solutions whose median time counts.
const RUNS: usize = 5;

/// One slab under 1 N at the middle of its top.
#[derive(Debug, Clone)]
pub struct Fem {
    /// The slab, of cubes of 1 mm.
    pub bricks: Bricks,
    /// From the numbers that describe the slab to the reactions: the median of five.
    pub solve_s: f64,
    /// What arrives at the base.
    pub reaction: Reaction,
}

impl Fem {
    /// Solves a slab, five times over.
    ///
    /// # Errors
    /// If a number is out of range.
    pub fn measure(across: u32, layers: u32, poisson_ratio: f64) -> Result<Self> {
        let bricks = Bricks::cubes(across, layers, 1.0, poisson_ratio)?;
        let mut reaction = bricks.under_point();
        let mut runs_s = Vec::with_capacity(RUNS);
        for _ in 0..RUNS {
            let started = Instant::now();
            reaction = black_box(black_box(bricks).under_point());
            runs_s.push(started.elapsed().as_secs_f64());
        }
        runs_s.sort_by(f64::total_cmp);
        Ok(Self { bricks, solve_s: runs_s[RUNS / 2], reaction })
    }
}
