//! Numbers that know nothing of tactile arrays: random numbers, medians, quantiles, work on several threads.
//!
//! Results do not depend on the machine or on the number of threads: random numbers follow from a seed, and the results of parallel
//! work keep the order of its items.

mod median;
mod normal;
pub(crate) mod parallel;
mod quantiles;
mod rng;
mod straight_line;

pub(crate) use median::{NORMAL_PER_MEDIAN, median};
pub(crate) use normal::{of_picked, upper_tail};
pub(crate) use quantiles::{Z_95, student_95};
pub(crate) use rng::Rng;
pub(crate) use straight_line::StraightLine;
