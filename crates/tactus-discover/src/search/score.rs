//! Score tests: would the residual shrink if the model changed in a given direction?
//!
//! The score of a direction `f` (a derivative of the prediction, less the part that the fitted
//! parameters explain) is, over blocks of bins,
//!
//! ```text
//! U_b = sum over block b of w r f        V_b = sum over block b of w f^2
//! z   = sum U_b / sqrt(phi sum V_b)
//! ```
//!
//! Without an effect, `U_b` is as likely as `-U_b`, whatever the noise does within a block. The distribution of the largest
//! of many `z` therefore follows from flipping the signs of whole blocks, in the same way for all directions. This controls
//! the probability of any false alarm among all directions, however they depend on each other, also under autocorrelated
//! noise. `phi >= 1` is the median excess of the scatter of blocks about their common value over that of their noise. As a
//! median it does not let an effect in a single block, or in all, inflate its own scatter. For the same reason a block
//! counts at most four standard deviations in the flipped sums.
//!
//! A direction that the residual itself picked from many, such as a pair of elements or the frequency of a tone, is not picked again under
//! flips. It is charged instead: its probability counts as many times as there were alternatives (Bonferroni).
//!
//! Several directions of one effect are made orthonormal under the weights and combined: the sum of the squares of their
//! scores is chi-square, which Wilson and Hilferty's cube root brings to the scale of a normal deviate.
//!
//! # Source
//! J. Hemerik, J. J. Goeman and L. Finos, *J. R. Stat. Soc. B* 82 (2020) 841 (sign-flipped scores); P. H. Westfall and
//! S. S. Young, *Resampling-Based Multiple Testing* (1993), ch. 2 (the largest of many).

use nalgebra::DMatrix;

use crate::fit::{CLIP, Grams};
use crate::numbers::{Rng, median, of_picked, parallel};

/// Median of the squared standard normal distribution.
const MEDIAN_SQUARE: f64 = 0.454_936;
/// Least number of blocks from which the excess scatter is estimated, and the excess assumed for fewer.
const BLOCKS_LEAST: usize = 8;
const EXCESS_OF_FEW: f64 = 1.5;
/// Number of directions whose flipped sums are one product of matrices: their parts stay in the cache.
const PANEL: usize = 256;

/// The score of one direction, or of several orthonormal ones together.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    /// On the scale of the standard normal distribution, not negative.
    pub(crate) z: f64,
    /// Mean excess of the blocks' scatter over that of their noise.
    pub(crate) excess: f64,
    /// For each direction, the part of each block, clipped.
    parts: Vec<Vec<f32>>,
    chi_square: ChiSquare,
}

/// Distribution of a sum of squares under flips: `times` chi-square with `freedom` degrees of freedom.
#[derive(Debug, Clone, Copy)]
struct ChiSquare {
    times: f64,
    freedom: f64,
}

/// A direction's score: what a test needs of it.
struct Standardised {
    z: f64,
    /// Excess of the blocks' scatter over that of their noise.
    excess: f64,
    /// The part of each block, clipped.
    parts: Vec<f32>,
}

/// A direction's score and its blocks' parts from the blocks' products with the residual and with themselves.
fn standardised(wanted: &[f64], variance: &[f64]) -> Standardised {
    let total: f64 = variance.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return Standardised { z: 0.0, excess: 1.0, parts: vec![0.0; wanted.len()] };
    }
    let common = wanted.iter().sum::<f64>() / total;
    // Blocks with hardly any weight in the direction say nothing about the scatter.
    let scatter: Vec<f64> = wanted
        .iter()
        .zip(variance)
        .filter(|(_, variance)| **variance > 1e-4 * total)
        .map(|(wanted, variance)| (wanted - common * variance).powi(2) / variance)
        .collect();
    let excess = if scatter.len() >= BLOCKS_LEAST {
        (median(&scatter) / MEDIAN_SQUARE).max(1.0)
    } else {
        EXCESS_OF_FEW
    };
    let deviation = (excess * total).sqrt();
    let parts = wanted.iter().zip(variance).map(|(wanted, variance)| {
        let most = CLIP * (excess * variance).sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "a part of a test's statistic")]
        let part = (wanted.clamp(-most, most) / deviation) as f32;
        part
    });
    Standardised { z: wanted.iter().sum::<f64>() / deviation, excess, parts: parts.collect() }
}

impl Score {
    /// The combined score of directions.
    pub(crate) fn of_grams(grams: &Grams, directions: &[usize]) -> Self {
        let products = grams.reduced();
        let blocks = directions.first().map_or(0, |one| grams.along(*one).len());
        // Rows of the orthonormal directions in terms of the given ones.
        let mut independent: Vec<Vec<(usize, f64)>> = Vec::new();
        for one in directions {
            let mut row = vec![(*one, 1.0)];
            for other in &independent {
                let inner: f64 = other.iter().map(|(number, share)| share * products[(*number, *one)]).sum();
                for (number, share) in other {
                    match row.iter_mut().find(|(known, _)| known == number) {
                        Some((_, value)) => *value -= inner * share,
                        None => row.push((*number, -inner * share)),
                    }
                }
            }
            let product = |(a, share): &(usize, f64)| -> f64 {
                row.iter().map(|(b, other)| share * other * products[(*a, *b)]).sum()
            };
            let square: f64 = row.iter().map(product).sum();
            let whole = products[(*one, *one)];
            if square > 1e-6 * whole && square > 0.0 {
                for (_, share) in &mut row {
                    *share /= square.sqrt();
                }
                independent.push(row);
            }
        }
        let scored = |row: &Vec<(usize, f64)>| {
            let sum =
                |block: usize| row.iter().map(|(number, share)| share * grams.along(*number)[block]).sum();
            let wanted: Vec<f64> = (0..blocks).map(sum).collect();
            // The blocks' shares of a sum of directions: those of its parts.
            let sizes: f64 =
                row.iter().map(|(number, share)| share * share * products[(*number, *number)]).sum();
            let square = |block: usize| {
                row.iter().map(|(number, share)| share * share * grams.squares(*number)[block]).sum::<f64>()
                    / sizes
            };
            let variance: Vec<f64> = (0..blocks).map(square).collect();
            standardised(&wanted, &variance)
        };
        Self::of(independent.iter().map(scored).collect())
    }

    /// The combined score of orthonormal directions.
    fn of(directions: Vec<Standardised>) -> Self {
        let freedom = directions.len() as f64;
        Self {
            z: deviate(directions.iter().map(|one| one.z * one.z).sum(), freedom),
            excess: directions.iter().map(|one| one.excess).sum::<f64>() / freedom.max(1.0),
            chi_square: ChiSquare { times: 1.0, freedom },
            parts: directions.into_iter().map(|one| one.parts).collect(),
        }
    }

    /// The same of a direction that the residual picked from so many: the pick is not repeated under flips, so its probability is
    /// multiplied by their number instead.
    pub(crate) fn picked_from(self, among: f64) -> Self {
        Self { z: of_picked(self.z, among), ..self }
    }

    /// The score of a sum of products of pairs of blocks, which is positive for any signs. Flips do not change the products of
    /// a block with itself; the others give the variance (F. E. Satterthwaite, *Biometrics Bull.* 2 (1946) 110).
    pub(crate) fn of_products(products: &DMatrix<f64>, blocks: &[usize], all_blocks: usize) -> Self {
        let mean = products.trace();
        let variance = 2.0 * (products.norm_squared() - products.diagonal().norm_squared());
        let none = Self {
            z: 0.0,
            excess: 1.0,
            parts: Vec::new(),
            chi_square: ChiSquare { times: 1.0, freedom: 0.0 },
        };
        // The diagonal does not depend on signs, so a small addition for the factorisation does no harm.
        let firm = DMatrix::from_diagonal_element(blocks.len(), blocks.len(), 1e-9 * mean);
        let Some(factors) = (products + firm).cholesky().filter(|_| variance > 0.0) else { return none };
        let chi_square = ChiSquare { times: variance / (2.0 * mean), freedom: 2.0 * mean * mean / variance };
        let part = |column: usize| {
            let mut part = vec![0.0; all_blocks];
            for (block, value) in blocks.iter().zip(factors.l_dirty().column(column).iter()).skip(column) {
                #[expect(clippy::cast_possible_truncation, reason = "a part of a test's statistic")]
                let value = *value as f32;
                part[*block] = value;
            }
            part
        };
        Self {
            z: deviate(products.sum() / chi_square.times, chi_square.freedom),
            excess: 1.0,
            parts: (0..blocks.len()).map(part).collect(),
            chi_square,
        }
    }
}

/// A chi-square number on the scale of a standard normal deviate, not negative.
///
/// # Source
/// E. B. Wilson and M. M. Hilferty, *Proc. Natl. Acad. Sci.* 17 (1931) 684.
fn deviate(chi_square: f64, freedom: f64) -> f64 {
    if freedom <= 0.0 {
        return 0.0;
    }
    let spread = 2.0 / (9.0 * freedom);
    (((chi_square / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()).max(0.0)
}

/// For each group, the largest of its scores in each of many sign-flipped data sets.
pub(crate) fn flipped(groups: &[Vec<&Score>], flips: usize, seed: u64) -> Vec<Vec<f64>> {
    let scores: Vec<(usize, &Score)> = groups
        .iter()
        .enumerate()
        .flat_map(|(group, scores)| scores.iter().map(move |score| (group, *score)))
        .collect();
    let blocks = scores.iter().flat_map(|(_, score)| score.parts.iter().map(Vec::len)).max().unwrap_or(0);
    let signs = signs(blocks, flips, seed);
    let mut largest = vec![vec![0.0; flips]; groups.len()];
    for of_panel in parallel::map(&panels(&scores), |panel| largest_of(panel, &signs)) {
        for (group, values) in of_panel {
            raise(&mut largest[group], values);
        }
    }
    largest
}

/// Signs of blocks (rows) in each flip (columns).
fn signs(blocks: usize, flips: usize, seed: u64) -> DMatrix<f32> {
    let mut rng = Rng::new(seed);
    let mut signs = DMatrix::from_element(blocks, flips, 1.0_f32);
    for chunk in signs.as_mut_slice().chunks_mut(blocks.max(1)).flat_map(|flip| flip.chunks_mut(64)) {
        let bits = rng.bits();
        for (place, sign) in chunk.iter_mut().enumerate() {
            *sign = if bits >> place & 1 == 1 { 1.0 } else { -1.0 };
        }
    }
    signs
}

/// Divides scores among panels with as many directions as one product of matrices takes.
fn panels<'a, 'b>(scores: &'a [(usize, &'b Score)]) -> Vec<&'a [(usize, &'b Score)]> {
    let mut panels = Vec::new();
    let (mut first, mut directions) = (0, 0);
    for (index, (_, score)) in scores.iter().enumerate() {
        if directions + score.parts.len() > PANEL && index > first {
            panels.push(&scores[first..index]);
            (first, directions) = (index, 0);
        }
        directions += score.parts.len();
    }
    panels.push(&scores[first..]);
    panels
}

/// The largest score of each group of a panel in each flip.
fn largest_of(panel: &[(usize, &Score)], signs: &DMatrix<f32>) -> Vec<(usize, Vec<f64>)> {
    let directions = panel.iter().flat_map(|(_, score)| &score.parts);
    let mut parts = DMatrix::zeros(directions.clone().count(), signs.nrows());
    for (direction, of_blocks) in directions.enumerate() {
        for (block, part) in of_blocks.iter().enumerate() {
            parts[(direction, block)] = *part;
        }
    }
    let sums = parts * signs;
    let mut largest: Vec<(usize, Vec<f64>)> = Vec::new();
    let mut first = 0;
    for (group, score) in panel {
        let own = sums.rows(first, score.parts.len());
        first += score.parts.len();
        let values = own.column_iter().map(|sums| {
            let squares = sums.iter().map(|sum| f64::from(*sum).powi(2)).sum::<f64>();
            deviate(squares / score.chi_square.times, score.chi_square.freedom)
        });
        match largest.last_mut().filter(|(last, _)| last == group) {
            Some((_, of_group)) => raise(of_group, values),
            None => largest.push((*group, values.collect())),
        }
    }
    largest
}

/// Raises each value to the other in its place if that is larger.
fn raise(values: &mut [f64], others: impl IntoIterator<Item = f64>) {
    for (value, other) in values.iter_mut().zip(others) {
        *value = value.max(other);
    }
}

/// The largest of all groups in each flipped data set.
pub(crate) fn largest(groups: &[Vec<f64>]) -> Vec<f64> {
    let flips = groups.first().map_or(0, Vec::len);
    (0..flips).map(|flip| groups.iter().map(|group| group[flip]).fold(0.0, f64::max)).collect()
}

/// Share of the Monte-Carlo statistics, including the data's own, that reach the data's.
pub(crate) fn p_value(statistic: f64, under_none: &[f64]) -> f64 {
    let reached = under_none.iter().filter(|other| **other >= statistic).count();
    (reached + 1) as f64 / (under_none.len() + 1) as f64
}

/// Probability that a sum of gains as large results from flips of their signs.
pub(crate) fn sign_flip_p(gains: &[f64], flips: usize, seed: u64) -> f64 {
    let mut rng = Rng::new(seed);
    let sum: f64 = gains.iter().sum();
    let flipped: Vec<f64> = (0..flips)
        .map(|_| gains.iter().map(|gain| if rng.bits() & 1 == 1 { *gain } else { -gain }).sum())
        .collect();
    p_value(sum, &flipped)
}

/// Adjusts p-values for the false-discovery rate.
///
/// # Source
/// Y. Benjamini and Y. Hochberg, *J. R. Stat. Soc. B* 57 (1995) 289.
pub(crate) fn q_values(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|a, b| p_values[*b].total_cmp(&p_values[*a]));
    let count = p_values.len();
    let mut q_values = vec![1.0; count];
    let mut least = 1.0_f64;
    for (above, index) in order.into_iter().enumerate() {
        least = least.min(p_values[index] * count as f64 / (count - above) as f64);
        q_values[index] = least;
    }
    q_values
}

#[cfg(test)]
#[path = "score_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "grams_tests.rs"]
mod tests_of_grams;
