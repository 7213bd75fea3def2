//! The path of a tip whose places come one by one.

use std::collections::VecDeque;

use crate::Path;

/// Where the tip was, for as long as an effect may ask: what a virtual device knows, whose future is not made yet.
///
/// Straight between the places that it was given; before the first and after the last the tip rests there.
#[derive(Debug, Clone, PartialEq)]
pub struct Trail {
    last: (f64, [f64; 3]),
    earlier: VecDeque<(f64, [f64; 3])>,
}

/// No effect asks for what was longer ago.
const KEPT_S: f64 = 1.0;

impl Trail {
    /// A trail that begins: a time in s and a place in mm, robot frame.
    pub fn new(t_s: f64, position_mm: [f64; 3]) -> Self {
        Self { last: (t_s, position_mm), earlier: VecDeque::new() }
    }

    /// Goes on to another place; one that is not later than the last takes its stead.
    pub fn push(&mut self, t_s: f64, position_mm: [f64; 3]) {
        if t_s > self.last.0 {
            self.earlier.push_back(self.last);
            self.last = (t_s, position_mm);
        } else {
            self.last.1 = position_mm;
        }
        while self.earlier.get(1).is_some_and(|(earlier_s, _)| *earlier_s < t_s - KEPT_S) {
            self.earlier.pop_front();
        }
    }
}

impl Path for Trail {
    fn at(&self, t_s: f64) -> [f64; 3] {
        let mut after = self.last;
        for &before in self.earlier.iter().rev() {
            if t_s >= after.0 {
                break;
            }
            if t_s >= before.0 {
                let share = (t_s - before.0) / (after.0 - before.0);
                return std::array::from_fn(|axis| before.1[axis] + share * (after.1[axis] - before.1[axis]));
            }
            after = before;
        }
        after.1
    }
}

#[cfg(test)]
#[path = "trail_tests.rs"]
mod tests;
