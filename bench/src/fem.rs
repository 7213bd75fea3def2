//! Time and result of the finite element model of the covering.

use std::convert::Infallible;
use std::hint::black_box;

use tactus_solid::fem::{Bricks, Reaction};

use crate::clock::timed;

/// Solutions; their median time counts.
const RUNS: usize = 5;

/// A slab under 1 N at the middle of its top.
#[derive(Debug, Clone)]
pub struct Fem {
    /// The mesh of the slab.
    pub bricks: Bricks,
    /// Median time, from the description of the slab to the reactions.
    pub solve_s: f64,
    /// Vertical reactions at the bottom.
    pub reaction: Reaction,
}

impl Fem {
    /// Solves a slab five times.
    pub fn measure(bricks: Bricks) -> Self {
        let solve = || Ok::<_, Infallible>(black_box(black_box(bricks).under_point()));
        let Ok((reaction, solve_s)) = timed(RUNS, solve);
        Self { bricks, solve_s, reaction }
    }
}
