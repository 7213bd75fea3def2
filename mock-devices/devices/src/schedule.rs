//! Random schedules of faults, made from a seed.
//!
//! A schedule is a list of lines as in a [`FaultScript`], so that a failing one can be printed, shortened by hand and played
//! again. Equal seeds give equal schedules. The faults are those that a lab can have; what the service cannot know, such as
//! another covering, is left out, because no promise covers it.
//!
//! ```
//! use std::time::Duration;
//! use tactus_virtual::schedule::Schedule;
//!
//! let schedule = Schedule::random(7, Duration::from_secs(20), 5, 48);
//! assert_eq!(schedule, Schedule::random(7, Duration::from_secs(20), 5, 48));
//! assert_eq!(schedule.script().unwrap().faults.len(), 5);
//! ```
//!
//! Play it with [`RigControl::play`](crate::RigControl::play). The true tip is
//! [`RigControl::tip_mm`](crate::RigControl::tip_mm), and the greatest true depth since the start, exact between events,
//! [`RigControl::deepest_mm`](crate::RigControl::deepest_mm).

use std::fmt;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::faults::{FaultScript, FaultScriptError};

/// Faults at set times, as text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Schedule {
    /// Time since the rig was switched on, and the line of the fault; sorted by time.
    pub faults: Vec<(Duration, String)>,
}

/// Faults that end by themselves, or hit a few bytes. `{ms}` is a time, `{n}` a small number, `{element}` an element.
const PASSING: [&str; 52] = [
    "sensor stall {ms}ms",
    "sensor drip {ms}ms",
    "sensor drop {n}",
    "sensor drop-frames {n}",
    "sensor flip-bits {n}",
    "sensor garbage {n}",
    "sensor duplicate",
    "sensor reorder",
    "sensor wrong-checksum",
    "sensor truncate",
    "sensor burst {n}",
    "sensor wrong-count {n}",
    "sensor clock-jump {ms}ms",
    "sensor clock-jump -{ms}ms",
    "sensor clock-wrap",
    "sensor stuck {element}",
    "sensor saturate {element}",
    "sensor freeze {ms}ms",
    "sensor zeros {n}",
    "sensor clear",
    "sensor disconnect {ms}ms",
    "sensor renumber",
    "to-sensor lose {ms}ms",
    "to-sensor flip-bits {n}",
    "to-sensor drop {n}",
    "from-sensor hold {ms}ms",
    "from-sensor repeat",
    "stage stall {ms}ms",
    "stage echo-garbage",
    "stage alarm 1",
    "stage alarm 3",
    "stage never-idle",
    "stage refuse",
    "stage ignore-moves",
    "stage reset",
    "stage homing-fails",
    "stage clear",
    "stage disconnect {ms}ms",
    "stage renumber",
    "to-stage lose {ms}ms",
    "to-stage hold {ms}ms",
    "to-stage drop {n}",
    "to-stage flip-bits 1",
    "to-stage double 1",
    "to-stage repeat",
    "to-stage truncate",
    "from-stage lose {ms}ms",
    "from-stage hold {ms}ms",
    "from-stage flip-bits {n}",
    "from-stage repeat",
    "from-stage reorder",
    "from-stage garbage {n}",
];

impl Schedule {
    /// `count` faults within `span`, for an array of so many elements.
    pub fn random(seed: u64, span: Duration, count: usize, elements: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut faults: Vec<(Duration, String)> = (0..count)
            .map(|_| {
                let at =
                    Duration::from_secs_f64((span.as_secs_f64() * rng.random::<f64>() * 1e3).round() / 1e3);
                let line = PASSING[rng.random_range(0..PASSING.len())]
                    .replace("{ms}", &rng.random_range(1..=3000).to_string())
                    .replace("{n}", &rng.random_range(1..=6).to_string())
                    .replace("{element}", &rng.random_range(0..elements.max(1)).to_string());
                (at, line)
            })
            .collect();
        faults.sort();
        Self { faults }
    }

    /// The faults to play.
    ///
    /// # Errors
    /// If a line is no fault; the lines of [`random`](Self::random) are faults.
    pub fn script(&self) -> Result<FaultScript, FaultScriptError> {
        FaultScript::from_toml(&self.to_string())
    }
}

impl fmt::Display for Schedule {
    /// The schedule as a script of faults.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, line) in &self.faults {
            writeln!(f, "[[fault]]\nat_s = {:?}\ncommand = {line:?}", at.as_secs_f64())?;
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "schedule_tests.rs"]
mod tests;
