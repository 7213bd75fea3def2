//! `crosstalk`: part of other elements' signals is added to an element's own.
//!
//! ```text
//! s_e -> s_e + neighbour_share     * (sum over the up to four nearest)
//!            + diagonal_share      * (sum over the up to four across its corners)
//!            + row_neighbour_share * (sum over the up to two beside it in its row)
//!            + second_share        * (sum over the up to four that are two away in its row or column)
//!            + ring_share          * (sum over the up to twelve others of the ring that is two away)
//!            + row_share           * (sum over the others of its row)
//!            + column_share        * (sum over the others of its column)
//!            + row_lean_share      * (the one before it in its row, less the one after it)
//!            + column_lean_share   * (the one before it in its column, less the one after it)
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `neighbour_share` | - | 0 | -0.5 to 0.5 | share of each of the up to four nearest neighbours |
//! | `diagonal_share` | - | 0 | -0.5 to 0.5 | share of each of the up to four neighbours across the corners |
//! | `row_neighbour_share` | - | 0 | -0.5 to 0.5 | share of each of the up to two neighbours in the same row |
//! | `row_share` | - | 0 | -0.5 to 0.5 | share of each other element of the same row |
//! | `column_share` | - | 0 | -0.5 to 0.5 | share of each other element of the same column |
//! | `second_share` | - | 0 | -0.5 to 0.5 | share of each of the up to four elements two away, in the same row or column |
//! | `ring_share` | - | 0 | -0.5 to 0.5 | share of each of the up to twelve others that are two away in row, column or both |
//! | `row_lean_share` | - | 0 | -0.5 to 0.5 | by how much more the one before it in the row shows than the one after it, halved |
//! | `column_lean_share` | - | 0 | -0.5 to 0.5 | the same in the column |
//! | `in_counts_share` | - | 0 | 0 to 1 | where signals mix: 0 in the covering or the field, before each element's sensitivity; 1 behind it, as counts above the baselines |
//!
//! So the matrix is a band of two rings about each element, and a level over its row and its column. In a row that leaks from column to column, neighbours answer most and the rest of the row less:
//! `row_neighbour_share` and `row_share` together follow such a ladder. A multiplexer that carries charge on shows the element that
//! was read before, and not the one after: `row_neighbour_share` and `row_lean_share` are equal.
//!
//! # Source
//! Row-column addressing: charge that leaks between the lines of a capacitive matrix, and stray capacitance
//! between neighbours.

use std::sync::OnceLock;

use super::{BaseModel, Definition, Make, Now, OnElement, Parameter};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "crosstalk",
    summary: "part of the signal of the neighbours, the row or the column is added",
    parameters: &[
        Parameter::real("neighbour_share", 0.0, [-0.5, 0.5]),
        Parameter::real("diagonal_share", 0.0, [-0.5, 0.5]),
        Parameter::real("row_neighbour_share", 0.0, [-0.5, 0.5]),
        Parameter::real("row_share", 0.0, [-0.5, 0.5]),
        Parameter::real("column_share", 0.0, [-0.5, 0.5]),
        Parameter::real("second_share", 0.0, [-0.5, 0.5]).or_neutral(),
        Parameter::real("ring_share", 0.0, [-0.5, 0.5]).or_neutral(),
        Parameter::real("row_lean_share", 0.0, [-0.5, 0.5]).or_neutral(),
        Parameter::real("column_lean_share", 0.0, [-0.5, 0.5]).or_neutral(),
        Parameter::real("in_counts_share", 0.0, [0.0, 1.0]).or_neutral(),
    ],
    near_twins: &["heavy-tail", "miswired", "anisotropic-spread", "sigma_intercept_mm"],
    acts_by: &[Covariate::SumOfSignals, Covariate::ShareOfLargest, Covariate::Counts],
    shown_by: &["element-centres", "grid-sweep"],
    curve: None,
    make: Make::Element(|values| {
        let (shares, in_counts_share) = (std::array::from_fn(|share| values[share]), values[REACHES.len()]);
        Box::new(Crosstalk { shares, in_counts_share, mixing: OnceLock::new() })
    }),
};

#[derive(Debug)]
struct Crosstalk {
    /// In the order of the parameters.
    shares: [f64; REACHES.len()],
    in_counts_share: f64,
    /// For the array, once it is known.
    mixing: OnceLock<Mixing>,
}

impl OnElement for Crosstalk {
    fn signal(&mut self, now: Now<'_>, _: &[f64], signal_mm: &mut [f64]) {
        let added_mm = self.mixing(now.base).added(signal_mm, 1.0 - self.in_counts_share);
        for (u, added) in signal_mm.iter_mut().zip(added_mm) {
            *u += added;
        }
    }

    fn counts(&self, base: BaseModel<'_>, counts: &mut [f64]) {
        if self.in_counts_share > 0.0 {
            let baselines = &base.model.response().baseline_counts;
            let rises: Vec<f64> =
                counts.iter().zip(baselines).map(|(count, baseline)| count - baseline).collect();
            let added = self.mixing(base).added(&rises, self.in_counts_share);
            counts.iter_mut().zip(added).for_each(|(count, added)| *count += added);
        }
    }
}

impl Crosstalk {
    fn mixing(&self, base: BaseModel<'_>) -> &Mixing {
        self.mixing.get_or_init(|| {
            let array = base.model.array();
            Mixing::of(&self.shares, array.rows(), array.cols())
        })
    }
}

/// Sums that go on side by side.
const LANES: usize = 4;

/// The matrix of shares, without its zeros.
#[derive(Debug)]
struct Mixing {
    /// For each element where its part of `parts` ends.
    ends: Vec<usize>,
    /// Another element, and the share of its signal.
    parts: Vec<(usize, f64)>,
}

impl Mixing {
    fn of(shares: &[f64; REACHES.len()], rows: usize, cols: usize) -> Self {
        let (mut ends, mut parts) = (Vec::with_capacity(rows * cols), Vec::new());
        for element in 0..rows * cols {
            let mut of_element = vec![0.0; rows * cols];
            for (reach, share) in REACHES.iter().zip(shares).filter(|(_, share)| **share != 0.0) {
                reach.visit([rows, cols], element, |other, weight| of_element[other] += share * weight);
            }
            parts.extend(of_element.into_iter().enumerate().filter(|(_, share)| *share != 0.0));
            ends.push(parts.len());
        }
        Self { ends, parts }
    }

    /// What is added to each element, times a factor.
    fn added(&self, values: &[f64], factor: f64) -> Vec<f64> {
        if factor == 0.0 || values.iter().all(|value| *value == 0.0) {
            return vec![0.0; self.ends.len()];
        }
        let mut start = 0;
        let of_element = |end: &usize| {
            let parts = self.parts[start..*end].chunks_exact(LANES);
            start = *end;
            let rest: f64 = parts.remainder().iter().map(|(other, share)| share * values[*other]).sum();
            let mut sums = [0.0; LANES];
            for lanes in parts {
                for (sum, (other, share)) in sums.iter_mut().zip(lanes) {
                    *sum += share * values[*other];
                }
            }
            factor * (sums.iter().sum::<f64>() + rest)
        };
        self.ends.iter().map(of_element).collect()
    }
}

/// From which others an element takes a share.
pub(super) enum Reach {
    /// Those at offsets in rows and columns, with a weight.
    Near(&'static [([isize; 2], f64)]),
    /// The others of its row.
    Row,
    /// The others of its column.
    Column,
}

/// The up to four nearest.
pub(super) const NEAREST: Reach =
    Reach::Near(&[([0, -1], 1.0), ([0, 1], 1.0), ([-1, 0], 1.0), ([1, 0], 1.0)]);

/// In the order of the effect's shares.
const REACHES: [Reach; 9] = [
    NEAREST,
    Reach::Near(&[([-1, -1], 1.0), ([-1, 1], 1.0), ([1, -1], 1.0), ([1, 1], 1.0)]),
    Reach::Near(&[([0, -1], 1.0), ([0, 1], 1.0)]),
    Reach::Row,
    Reach::Column,
    Reach::Near(&[([0, -2], 1.0), ([0, 2], 1.0), ([-2, 0], 1.0), ([2, 0], 1.0)]),
    Reach::Near(&RING),
    Reach::Near(&[([0, -1], 1.0), ([0, 1], -1.0)]),
    Reach::Near(&[([-1, 0], 1.0), ([1, 0], -1.0)]),
];

/// What is two away in row or column, less what is straight so.
const RING: [([isize; 2], f64); 12] = [
    ([-2, -2], 1.0),
    ([-2, -1], 1.0),
    ([-2, 1], 1.0),
    ([-2, 2], 1.0),
    ([-1, -2], 1.0),
    ([-1, 2], 1.0),
    ([1, -2], 1.0),
    ([1, 2], 1.0),
    ([2, -2], 1.0),
    ([2, -1], 1.0),
    ([2, 1], 1.0),
    ([2, 2], 1.0),
];

impl Reach {
    /// Visits the others that exist, each with its weight.
    pub(super) fn visit(&self, [rows, cols]: [usize; 2], element: usize, mut visit: impl FnMut(usize, f64)) {
        let (row, col) = (element / cols, element % cols);
        match self {
            Self::Near(offsets) => {
                for ([down, along], weight) in *offsets {
                    let row = row.checked_add_signed(*down).filter(|row| *row < rows);
                    let col = col.checked_add_signed(*along).filter(|col| *col < cols);
                    if let (Some(row), Some(col)) = (row, col) {
                        visit(row * cols + col, *weight);
                    }
                }
            }
            Self::Row => {
                (0..cols).filter(|other| *other != col).for_each(|other| visit(row * cols + other, 1.0));
            }
            Self::Column => {
                (0..rows).filter(|other| *other != row).for_each(|other| visit(other * cols + col, 1.0));
            }
        }
    }
}

#[cfg(test)]
#[path = "crosstalk_tests.rs"]
mod tests;
