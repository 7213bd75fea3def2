//! The finite element model of the covering: the time of one solution, and the reactions.

use std::convert::Infallible;
use std::hint::black_box;

use tactus_solid::fem::{Bricks, Reaction};

use crate::clock::timed;

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
        let solve = || Ok::<_, Infallible>(black_box(black_box(bricks).under_point()));
        let Ok((reaction, solve_s)) = timed(RUNS, solve);
        Self { bricks, solve_s, reaction }
    }
}
