//! The finite element model of the covering: the time of one solution, and the reactions.

use std::hint::black_box;
use std::time::Instant;

use tactus_solid::fem::{Bricks, Reaction};

/// Solutions whose median time counts.
const RUNS: usize = 5;

/// One slab under 1 N at the middle of its top.
#[derive(Debug, Clone)]
pub struct Fem {
    /// The slab.
    pub bricks: Bricks,
    /// From the numbers that describe the slab to the reactions: the median of five.
    pub solve_s: f64,
    /// What arrives at the base.
    pub reaction: Reaction,
}

impl Fem {
    /// Solves a slab, five times over.
    pub fn measure(bricks: Bricks) -> Self {
        let mut reaction = bricks.under_point();
        let mut runs_s = Vec::with_capacity(RUNS);
        for _ in 0..RUNS {
            let started = Instant::now();
            reaction = black_box(black_box(bricks).under_point());
            runs_s.push(started.elapsed().as_secs_f64());
        }
        runs_s.sort_by(f64::total_cmp);
        Self { bricks, solve_s: runs_s[RUNS / 2], reaction }
    }
}
