//! `crosstalk`: part of other elements' signals is added to an element's own.
//!
//! ```text
//! u_e -> u_e + neighbour_share * (sum over the up to four nearest)
//!            + row_share       * (sum over the others of its row)
//!            + column_share    * (sum over the others of its column)
//! ```
//!
//! # Source
//! Row-column addressing: charge that leaks between the lines of a capacitive matrix, and stray capacitance
//! between neighbours.

use super::{Base, Definition, Make, OnElement, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "crosstalk",
    summary: "part of the signal of the neighbours, the row or the column is added",
    parameters: &[
        Parameter::real("neighbour_share", 0.0, [-0.5, 0.5]),
        Parameter::real("row_share", 0.0, [-0.5, 0.5]),
        Parameter::real("column_share", 0.0, [-0.5, 0.5]),
    ],
    near_twins: &["heavy-tail", "miswired", "anisotropic-spread", "sigma_intercept_mm"],
    shown_by: &["element-centres", "grid-sweep"],
    make: Make::Element(|values| Box::new(Crosstalk { shares: [values[0], values[1], values[2]] })),
};

/// Shares of the neighbours, of the row and of the column.
#[derive(Debug)]
struct Crosstalk {
    shares: [f64; 3],
}

impl OnElement for Crosstalk {
    fn signal(&self, base: Base<'_>, _: &[f64], signal_mm: &mut [f64]) {
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

    fn slope(
        &self,
        parameter: usize,
        base: Base<'_>,
        _: &[f64],
        before_mm: &[f64],
        slope_mm: &mut [f64],
    ) -> bool {
        let Some(sum) = SUMS.get(parameter) else { return false };
        slope_mm.copy_from_slice(&sum(base.model.array().cols(), before_mm));
        true
    }
}

/// For every element the sum over some of the others; rows have so many columns.
type Sum = fn(usize, &[f64]) -> Vec<f64>;

/// In the order of the shares.
const SUMS: [Sum; 3] = [of_neighbours, of_rows, of_columns];

fn of_neighbours(cols: usize, values: &[f64]) -> Vec<f64> {
    let value =
        |is_there: bool, index: usize| if is_there { values.get(index).copied().unwrap_or(0.0) } else { 0.0 };
    (0..values.len())
        .map(|index| {
            let col = index % cols;
            value(col > 0, index.wrapping_sub(1))
                + value(col + 1 < cols, index + 1)
                + value(true, index.wrapping_sub(cols))
                + value(true, index + cols)
        })
        .collect()
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
