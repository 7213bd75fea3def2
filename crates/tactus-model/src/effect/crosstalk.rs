//! `crosstalk`: part of other elements' signals is added to an element's own.
//!
//! ```text
//! u_e -> u_e + neighbour_share     * (sum over the up to four nearest)
//!            + diagonal_share      * (sum over the up to four across its corners)
//!            + row_neighbour_share * (sum over the up to two beside it in its row)
//!            + row_share           * (sum over the others of its row)
//!            + column_share        * (sum over the others of its column)
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `neighbour_share` | - | 0 | -0.5 to 0.5 | share of each of the up to four nearest neighbours |
//! | `diagonal_share` | - | 0 | -0.5 to 0.5 | share of each of the up to four neighbours across the corners |
//! | `row_neighbour_share` | - | 0 | -0.5 to 0.5 | share of each of the up to two neighbours in the same row |
//! | `row_share` | - | 0 | -0.5 to 0.5 | share of each other element of the same row |
//! | `column_share` | - | 0 | -0.5 to 0.5 | share of each other element of the same column |
//!
//! In a row that leaks from column to column, neighbours answer most and the rest of the row less: `row_neighbour_share` and
//! `row_share` together follow such a ladder.
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
    ],
    near_twins: &["heavy-tail", "miswired", "anisotropic-spread", "sigma_intercept_mm"],
    shown_by: &["element-centres", "grid-sweep"],
    curve: None,
    make: Make::Element(|values| Box::new(Crosstalk { shares: std::array::from_fn(|share| values[share]) })),
};

/// Shares in the order of the parameters.
#[derive(Debug)]
struct Crosstalk {
    shares: [f64; SUMS.len()],
}

impl OnElement for Crosstalk {
    fn signal(&self, base: BaseModel<'_>, _: &[f64], signal_mm: &mut [f64]) {
        let mut added_mm = vec![0.0; signal_mm.len()];
        for (sum, share) in SUMS.iter().zip(self.shares).filter(|(_, share)| *share != 0.0) {
            for (added, from_others) in added_mm.iter_mut().zip(sum(base.model.array().cols(), signal_mm)) {
                *added += share * from_others;
            }
        }
        for (u, added) in signal_mm.iter_mut().zip(added_mm) {
            *u += added;
        }
    }
}

/// For every element the sum over some others; the first argument is the number of columns.
type Sum = fn(usize, &[f64]) -> Vec<f64>;

/// The sums, in the order of the effect's shares.
const SUMS: [Sum; 5] = [
    |cols, values| of_near(cols, values, &[[0, -1], [0, 1], [-1, 0], [1, 0]]),
    |cols, values| of_near(cols, values, &[[-1, -1], [-1, 1], [1, -1], [1, 1]]),
    |cols, values| of_near(cols, values, &[[0, -1], [0, 1]]),
    of_rows,
    of_columns,
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
