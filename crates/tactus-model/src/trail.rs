//! The path of a tip whose positions become known one by one.

use std::collections::VecDeque;

use crate::Path;

/// Recent positions of the tip, kept for as long as an effect can look back. A virtual device uses it because the future of
/// its path is unknown.
///
/// The path is straight between the positions; the tip rests before the first and after the last.
#[derive(Debug, Clone, PartialEq)]
pub struct Trail {
    last: (f64, [f64; 3]),
    earlier: VecDeque<(f64, [f64; 3])>,
}

/// No effect looks back further.
const KEPT_S: f64 = 1.0;

impl Trail {
    /// A trail with one point: a time in s and a position in mm, robot frame.
    pub fn new(t_s: f64, position_mm: [f64; 3]) -> Self {
        Self { last: (t_s, position_mm), earlier: VecDeque::new() }
    }

    /// Adds a position. It replaces the last one if it is not later.
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
