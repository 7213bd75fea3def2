//! `scan-skew`: the elements of a frame are sampled one after another.
//!
//! ```text
//! counts_k(t) -> counts_k(t - (last - k) element_time)          k row-major, of 0 .. last
//! ```
//!
//! A frame bears the time of its last element; the first was sampled longest ago. Between moments counts are taken
//! to run straight, and what was before the first to be as the first. All elements together are late by half a scan,
//! which is `time-lag`; what tells them apart is that the first are later than the last.
//!
//! Derivative in closed form. Cost: a short history, as long as a scan.
//!
//! # Source
//! Sequential sampling of a multiplexed converter: W. Kester (ed.), *The Data Conversion Handbook* (2005).

use std::collections::VecDeque;

use super::{Definition, Make, Now, OnReadout, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "scan-skew",
    summary: "elements are sampled one after another within a frame",
    parameters: &[Parameter::real("element_time_s", 0.0, [0.0, 0.01])],
    near_twins: &["time-lag", "low-pass"],
    shown_by: &["rates"],
    make: Make::Readout(|values| {
        let element_time_s = values[0];
        Box::new(ScanSkew { element_time_s, history: VecDeque::new(), slope_counts: Vec::new() })
    }),
};

#[derive(Debug)]
struct ScanSkew {
    element_time_s: f64,
    /// Moments by their age, oldest first.
    history: VecDeque<Past>,
    slope_counts: Vec<f64>,
}

#[derive(Debug)]
struct Past {
    age_s: f64,
    counts: Vec<f64>,
}

impl OnReadout for ScanSkew {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        for past in &mut self.history {
            past.age_s += now.dt_s;
        }
        self.history.push_back(Past { age_s: 0.0, counts: counts.to_vec() });
        // The second oldest is older than any element's age: the oldest is not needed.
        let last = counts.len().saturating_sub(1);
        let scan_s = last as f64 * self.element_time_s;
        while self.history.get(1).is_some_and(|past| past.age_s > scan_s) {
            self.history.pop_front();
        }
        self.slope_counts.clear();
        for (element, count) in counts.iter_mut().enumerate() {
            let places_before = (last - element) as f64;
            let (then, per_s) = self.at(element, places_before * self.element_time_s);
            *count = then;
            self.slope_counts.push(-places_before * per_s);
        }
    }

    fn slope(&self, parameter: usize, slope_counts: &mut [f64]) -> bool {
        let known = parameter == 0 && !self.slope_counts.is_empty();
        if known {
            slope_counts.copy_from_slice(&self.slope_counts);
        }
        known
    }

    fn reset(&mut self) {
        self.history.clear();
    }
}

impl ScanSkew {
    /// What an element had so long ago, and how fast that was changing.
    fn at(&self, element: usize, age_s: f64) -> (f64, f64) {
        let pairs = self.history.iter().zip(self.history.iter().skip(1));
        let Some((older, newer)) = pairs.rev().find(|(older, _)| age_s <= older.age_s) else {
            return (self.history[0].counts[element], 0.0);
        };
        let (before, after) = (older.counts[element], newer.counts[element]);
        let between_s = older.age_s - newer.age_s;
        let per_s = if between_s > 0.0 { (after - before) / between_s } else { 0.0 };
        // What is asked for as it is now is given to the bit.
        let count = if age_s > newer.age_s { after - per_s * (age_s - newer.age_s) } else { after };
        (count, per_s)
    }
}

#[cfg(test)]
#[path = "scan_skew_tests.rs"]
mod tests;
