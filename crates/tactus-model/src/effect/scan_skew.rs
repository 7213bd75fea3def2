//! `scan-skew`: the elements of a frame are sampled one after another.
//!
//! ```text
//! counts(t) -> counts(t - (last_row - row) row_time - (last_column - column) column_time)
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `row_time_s` | s | 0 | 0 to 0.1 | time from the sampling of a row to that of the next |
//! | `column_time_s` | s | 0 | 0 to 0.1 | time from the sampling of a column to that of the next |
//!
//! If elements are sampled one by one, row by row, `row_time` is `column_time` times the number of columns. If whole rows are
//! sampled at once, `column_time` is 0; if whole columns, `row_time` is 0. A frame has the time of its last element; the first
//! element was sampled longest before. Counts run straight between two moments, and before the first moment they are as at the
//! first. On average the elements are late by half a scan, which is also a `time-lag`; but here the first ones are later than
//! the last.
//!
//! Cost: a short history, as long as a scan.
//!
//! # Source
//! Sequential sampling of a multiplexed converter: W. Kester (ed.), *The Data Conversion Handbook* (2005).

use std::collections::VecDeque;

use super::{Definition, Make, Now, OnReadout, Parameter};
use crate::Array;
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "scan-skew",
    summary: "elements are sampled one after another within a frame",
    parameters: &[
        Parameter::real("row_time_s", 0.0, [0.0, 0.1]),
        Parameter::real("column_time_s", 0.0, [0.0, 0.1]),
    ],
    near_twins: &["time-lag", "low-pass"],
    acts_by: &[Covariate::Speed, Covariate::TravelSpeed, Covariate::Direction],
    shown_by: &["rates"],
    curve: None,
    make: Make::Readout(|values| {
        let times_s = [values[0], values[1]];
        Box::new(ScanSkew { times_s, history: VecDeque::new(), slope_counts: [const { Vec::new() }; 2] })
    }),
};

#[derive(Debug)]
struct ScanSkew {
    /// Of a row and of a column.
    times_s: [f64; 2],
    /// Moments by their age, oldest first.
    history: VecDeque<PastFrame>,
    /// By either time.
    slope_counts: [Vec<f64>; 2],
}

#[derive(Debug)]
struct PastFrame {
    age_s: f64,
    counts: Vec<f64>,
}

impl OnReadout for ScanSkew {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        for past in &mut self.history {
            past.age_s += now.dt_s;
        }
        self.history.push_back(PastFrame { age_s: 0.0, counts: counts.to_vec() });
        // The second oldest is older than any element's age: the oldest is not needed.
        let array = now.base.model.array();
        let scan_s = self.age_s(places_before(0, array));
        while self.history.get(1).is_some_and(|past| past.age_s > scan_s) {
            self.history.pop_front();
        }
        self.slope_counts.iter_mut().for_each(Vec::clear);
        for (element, count) in counts.iter_mut().enumerate() {
            let places = places_before(element, array);
            let (then, per_s) = self.at(element, self.age_s(places));
            *count = then;
            for (slopes, places) in self.slope_counts.iter_mut().zip(places) {
                slopes.push(-places * per_s);
            }
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.history.clear();
    }
}

impl ScanSkew {
    /// How long ago an element was sampled that is this many rows and columns before the last.
    fn age_s(&self, [rows, columns]: [f64; 2]) -> f64 {
        rows * self.times_s[0] + columns * self.times_s[1]
    }

    /// An element's counts `age_s` ago, and how fast they changed.
    fn at(&self, element: usize, age_s: f64) -> (f64, f64) {
        let pairs = self.history.iter().zip(self.history.iter().skip(1));
        let Some((older, newer)) = pairs.rev().find(|(older, _)| age_s <= older.age_s) else {
            return (self.history[0].counts[element], 0.0);
        };
        let (before, after) = (older.counts[element], newer.counts[element]);
        let between_s = older.age_s - newer.age_s;
        let per_s = if between_s > 0.0 { (after - before) / between_s } else { 0.0 };
        // Age 0 returns the present counts to the bit.
        let count = if age_s > newer.age_s { after - per_s * (age_s - newer.age_s) } else { after };
        (count, per_s)
    }
}

/// How many rows and columns an element comes before the last.
fn places_before(element: usize, array: &Array) -> [f64; 2] {
    let (row, column) = (element / array.cols(), element % array.cols());
    [(array.rows() - 1 - row) as f64, (array.cols() - 1 - column) as f64]
}

#[cfg(test)]
#[path = "scan_skew_tests.rs"]
mod tests;
