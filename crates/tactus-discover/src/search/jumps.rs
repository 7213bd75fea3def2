//! Jumps along a covariate: the place at which a residual jumps most clearly, and among how many.
//!
//! The residual and the square of what the jump multiplies are summed in narrow cells of the covariate. With `Q` and `S` those sums over all
//! readings above a place, and `q` and `s` over all, the power of a jump there is
//!
//! ```text
//! P = (Q - S q / s)^2 / (S (1 - S / s))
//! ```
//!
//! # Source
//! A. Sen and M. S. Srivastava, *Ann. Stat.* 3 (1975) 98: a change of the mean at an unknown place.

use super::cells::{Cells, Point};

/// Cells of the covariate's range.
pub(super) const CELLS: usize = 1024;
/// On each side of a jump lies at least this share of the weight: the readings of a few presses make no jump.
const SHARE_LEAST: f64 = 0.005;

/// A place that was picked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Jump {
    pub(super) at: f64,
    /// Number of places from which it was picked.
    pub(super) among: f64,
}

/// The clearest jump; `None` if the covariate does not vary.
pub(super) fn clearest(points: &(impl Iterator<Item = Point> + Clone)) -> Option<Jump> {
    let cells = Cells::of(points, CELLS)?;
    let [wanted, square] = cells.total();
    let mut best: Option<(f64, usize)> = None;
    let mut among = 0.0;
    let (mut above_wanted, mut above_square) = (0.0, 0.0);
    for cell in (1..CELLS).rev() {
        let [of_wanted, of_square] = cells.sums[cell];
        above_wanted += of_wanted;
        above_square += of_square;
        let share = above_square / square;
        if of_square == 0.0 || !(SHARE_LEAST..=1.0 - SHARE_LEAST).contains(&share) {
            continue;
        }
        among += 1.0;
        let power = (above_wanted - share * wanted).powi(2) / (above_square * (1.0 - share));
        if best.is_none_or(|(most, _)| power > most) {
            best = Some((power, cell));
        }
    }
    best.map(|(_, cell)| Jump { at: cells.least + cell as f64 / CELLS as f64 * cells.range, among })
}

#[cfg(test)]
#[path = "jumps_tests.rs"]
mod tests;
