//! The score of a random walk of the baselines at the residual of a model.
//!
//! The test for a random walk flips the signs of blocks, like that of every effect. With `U_be` the sum of the weighted
//! residual of element `e` in block `b`, and `K_bc` a kernel that falls with the time between two blocks,
//!
//! ```text
//! S = sum over b, c of K_bc sum over e of U_be U_ce
//! ```
//!
//! Flips do not change the products of a block with itself. `S` is large if blocks that are near in time are alike. Pairs of blocks
//! within the memory of the noise do not count: coloured noise makes them alike.
//!
//! # Source
//! X. Lin, *Biometrika* 84 (1997) 309.

use nalgebra::{DMatrix, DVector};

use super::score::Score;
use crate::data::{DiscoverError, interval_s};
use crate::fit::{Fitted, Problem, RANDOM_WALK, Term, is_random_walk};

/// A correlation of the noise that makes no blocks alike.
const FORGOTTEN: f64 = 0.01;
/// Time constants of the kernels of the test.
const KERNELS_S: [f64; 3] = [10.0, 40.0, 160.0];
/// Greatest number of blocks in the test.
const BLOCKS_MAX: usize = 600;

/// A random walk that a model does not have.
pub(crate) struct TriedWalk {
    /// For each kernel of the test.
    pub(crate) scores: Vec<Score>,
    /// Reduction of the cost.
    pub(crate) promise: f64,
    /// The term from which a fit starts.
    pub(crate) start: Term,
}

impl Problem<'_> {
    /// A random walk at the residual of a model; `None` if the model has one. The residual without contact must show it too,
    /// because in contact any missing effect resembles a walk.
    pub(crate) fn tried_walk(&self, at: &Fitted) -> Result<Option<TriedWalk>, DiscoverError> {
        if at.parameters.terms.iter().any(is_random_walk) {
            return Ok(None);
        }
        let residual = self.left(at)?;
        let walk = self.estimate_walk(&residual, &self.slow);
        let clear = self.estimate_walk(&residual, &self.slow_and_clear);
        let mut start = Term::neutral(&RANDOM_WALK);
        start.values[..2].copy_from_slice(&[walk.counts_per_root_s, walk.knot_s]);
        let promise = walk.gain.min(clear.gain);
        Ok(Some(TriedWalk { scores: self.alike(&residual), promise, start }))
    }

    /// Scores for each kernel whether blocks that are near in time are alike.
    fn alike(&self, residual: &[f64]) -> Vec<Score> {
        let bins = self.predictor.bins;
        let elements = bins.elements;
        let mut sums = vec![0.0; bins.blocks * elements];
        let (mut weights, mut times, mut runs) =
            (vec![0.0; bins.blocks], vec![0.0; bins.blocks], vec![0; bins.blocks]);
        let mut spans_s = vec![[f64::INFINITY, f64::NEG_INFINITY]; bins.blocks];
        for ((bin, values), weight) in residual.chunks_exact(elements).enumerate().zip(&self.slow_and_clear) {
            let block = bins.block[bin];
            runs[block] = bins.run[bin];
            weights[block] += weight;
            times[block] += weight * bins.t_s[bin];
            if *weight > 0.0 {
                let [first_s, last_s] = spans_s[block];
                spans_s[block] = [first_s.min(bins.t_s[bin]), last_s.max(bins.t_s[bin])];
            }
            let of_block = sums[block * elements..].iter_mut().zip(values).zip(&self.element_weight);
            of_block.for_each(|((sum, value), of_element)| *sum += weight * of_element * value);
        }
        let mut used: Vec<usize> = (0..bins.blocks).filter(|block| weights[*block] > 0.0).collect();
        used.truncate(BLOCKS_MAX);
        let count = used.len();
        let sums = DMatrix::from_fn(count, elements, |b, e| sums[used[b] * elements + e]);
        let products = &sums * sums.transpose();
        // Flipped residuals have a mean. The baseline of each run fits it.
        let mut totals = vec![0.0; bins.paths.len()];
        for block in &used {
            totals[runs[*block]] += weights[*block];
        }
        let shares = DVector::from_fn(count, |b, _| weights[used[b]] / totals[runs[used[b]]]);
        let memory_s = self.memory_s();
        let is_near = |b: usize, c: usize| {
            let [[first_b, last_b], [first_c, last_c]] = [spans_s[used[b]], spans_s[used[c]]];
            b != c && (first_b - last_c).max(first_c - last_b) < memory_s
        };
        let of = |kernel_s: &f64| {
            let same = |b: usize, c: usize| runs[used[b]] == runs[used[c]];
            let apart_s = |b: usize, c: usize| {
                (times[used[b]] / weights[used[b]] - times[used[c]] / weights[used[c]]).abs()
            };
            let kernel = DMatrix::from_fn(count, count, |b, c| {
                if same(b, c) { (-apart_s(b, c) / kernel_s).exp() } else { 0.0 }
            });
            let means = &kernel * &shares;
            let mut of_run = vec![0.0; totals.len()];
            for b in 0..count {
                of_run[runs[used[b]]] += shares[b] * means[b];
            }
            let mut products = DMatrix::from_fn(count, count, |b, c| {
                let centred = kernel[(b, c)] - means[b] - means[c] + of_run[runs[used[b]]];
                if same(b, c) { centred * products[(b, c)] } else { 0.0 }
            });
            for b in 0..count {
                for c in (0..count).filter(|c| same(b, *c) && is_near(b, *c)) {
                    // What flips do not change keeps the sum positive for any signs.
                    products[(b, b)] += products[(b, c)].abs();
                    products[(b, c)] = 0.0;
                }
            }
            Score::of_products(&products, &used, bins.blocks)
        };
        KERNELS_S.iter().map(of).collect()
    }

    /// Time after which the correlation of the noise is below [`FORGOTTEN`], if it is first-order autoregressive.
    fn memory_s(&self) -> f64 {
        let square = (self.squares_inflation - 1.0) / (self.squares_inflation + 1.0);
        let phi = square.clamp(1e-12, 0.98).sqrt();
        FORGOTTEN.ln() / phi.ln() * interval_s(self.predictor.frames)
    }
}
