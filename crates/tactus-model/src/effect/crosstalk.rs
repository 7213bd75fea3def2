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

use super::{BaseModel, Definition, Make, OnElement, Parameter};

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
    shown_by: &["element-centres", "grid-sweep"],
    curve: None,
    make: Make::Element(|values| {
        let (shares, in_counts_share) = (std::array::from_fn(|share| values[share]), values[SUMS.len()]);
        Box::new(Crosstalk { shares, in_counts_share })
    }),
};

#[derive(Debug)]
struct Crosstalk {
    /// In the order of the parameters.
    shares: [f64; SUMS.len()],
    in_counts_share: f64,
}

impl OnElement for Crosstalk {
    fn signal(&self, base: BaseModel<'_>, _: &[f64], signal_mm: &mut [f64]) {
        let added_mm = self.added(base, signal_mm, 1.0 - self.in_counts_share);
        for (u, added) in signal_mm.iter_mut().zip(added_mm) {
            *u += added;
        }
    }

    fn counts(&self, base: BaseModel<'_>, counts: &mut [f64]) {
        if self.in_counts_share > 0.0 {
            let baselines = &base.model.response().baseline_counts;
            let rises: Vec<f64> =
                counts.iter().zip(baselines).map(|(count, baseline)| count - baseline).collect();
            let added = self.added(base, &rises, self.in_counts_share);
            counts.iter_mut().zip(added).for_each(|(count, added)| *count += added);
        }
    }
}

impl Crosstalk {
    /// What is added to each element, times a factor.
    fn added(&self, base: BaseModel<'_>, values: &[f64], factor: f64) -> Vec<f64> {
        let mut added = vec![0.0; values.len()];
        for (sum, share) in SUMS.iter().zip(self.shares).filter(|(_, share)| *share != 0.0) {
            for (added, from_others) in added.iter_mut().zip(sum(base.model.array().cols(), values)) {
                *added += factor * share * from_others;
            }
        }
        added
    }
}

/// For every element the sum over some others; the first argument is the number of columns.
type Sum = fn(usize, &[f64]) -> Vec<f64>;

/// The sums, in the order of the effect's shares.
const SUMS: [Sum; 9] = [
    |cols, values| of_near(cols, values, &[[0, -1], [0, 1], [-1, 0], [1, 0]]),
    |cols, values| of_near(cols, values, &[[-1, -1], [-1, 1], [1, -1], [1, 1]]),
    |cols, values| of_near(cols, values, &[[0, -1], [0, 1]]),
    of_rows,
    of_columns,
    |cols, values| of_near(cols, values, &[[0, -2], [0, 2], [-2, 0], [2, 0]]),
    |cols, values| of_near(cols, values, &RING),
    |cols, values| less(of_near(cols, values, &[[0, -1]]), of_near(cols, values, &[[0, 1]])),
    |cols, values| less(of_near(cols, values, &[[-1, 0]]), of_near(cols, values, &[[1, 0]])),
];

/// What is two away in row or column, less what is straight so.
const RING: [[isize; 2]; 12] = [
    [-2, -2],
    [-2, -1],
    [-2, 1],
    [-2, 2],
    [-1, -2],
    [-1, 2],
    [1, -2],
    [1, 2],
    [2, -2],
    [2, -1],
    [2, 1],
    [2, 2],
];

/// Sum over the existing elements at these offsets, in rows and columns.
fn of_near(cols: usize, values: &[f64], places: &[[isize; 2]]) -> Vec<f64> {
    let rows = values.len() / cols;
    let at = |index: usize, [down, along]: [isize; 2]| {
        let row = (index / cols).checked_add_signed(down).filter(|row| *row < rows)?;
        let col = (index % cols).checked_add_signed(along).filter(|col| *col < cols)?;
        values.get(row * cols + col)
    };
    (0..values.len()).map(|index| places.iter().filter_map(|place| at(index, *place)).sum()).collect()
}

fn less(values: Vec<f64>, others: Vec<f64>) -> Vec<f64> {
    values.into_iter().zip(others).map(|(value, other)| value - other).collect()
}

fn of_rows(cols: usize, values: &[f64]) -> Vec<f64> {
    let others = |row: &[f64]| -> Vec<f64> {
        let sum: f64 = row.iter().sum();
        row.iter().map(|own| sum - own).collect()
    };
    values.chunks(cols).flat_map(others).collect()
}

fn of_columns(cols: usize, values: &[f64]) -> Vec<f64> {
    let sum = |col: usize| -> f64 { values.iter().skip(col).step_by(cols).sum() };
    let sums: Vec<f64> = (0..cols).map(sum).collect();
    values.iter().zip(sums.iter().cycle()).map(|(own, sum)| sum - own).collect()
}

#[cfg(test)]
#[path = "crosstalk_tests.rs"]
mod tests;
