//! Random schedules of faults, made from a seed.
//!
//! A schedule is a list of lines as in a [`FaultScript`], so that a failing one can be printed, reduced ([`shrink()`]) and played
//! again. Equal seeds give equal schedules. The faults are those that a lab can have. Some hide from the service where the tip is;
//! [`Schedule::hidden_mm`] says by how much. Another covering or surface is left out, because no promise covers it.
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

mod shrink;

use std::fmt;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::faults::{ControllerFault, FaultScript, FaultScriptError, InjectedFault, StageFault};

pub use shrink::{Shrunk, shrink};

/// Faults at set times, as text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Schedule {
    /// Time since the rig was switched on, and the line of the fault; sorted by time.
    pub faults: Vec<(Duration, String)>,
}

/// Faults that end by themselves, hit a few bytes, or end with `clear`. `{ms}` is a time, `{n}` a small number, `{counts}` a
/// number of counts, `{mm}` a length, `{factor}` a factor, `{element}` an element.
const PASSING: [&str; 73] = [
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
    "sensor clock-drift {n}00",
    "sensor clock-drift -{n}00",
    "sensor stuck {element}",
    "sensor saturate {element}",
    "sensor freeze {ms}ms",
    "sensor zeros {counts}",
    "sensor clear",
    "sensor disconnect {ms}ms",
    "sensor renumber",
    "to-sensor lose {ms}ms",
    "to-sensor flip-bits {n}",
    "to-sensor drop {n}",
    "to-sensor garbage {n}",
    "to-sensor repeat",
    "from-sensor lose {ms}ms",
    "from-sensor hold {ms}ms",
    "from-sensor drop {n}",
    "from-sensor double {n}",
    "from-sensor repeat",
    "from-sensor reorder",
    "stage stall {ms}ms",
    "stage echo-garbage",
    "stage alarm 1",
    "stage alarm 2",
    "stage alarm 3",
    "stage lie {mm}",
    "stage lie -{mm}",
    "stage lost-steps {mm}",
    "stage work-offset -{mm}",
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
    "to-stage drip {ms}ms",
    "to-stage garbage {n}",
    "to-stage reorder",
    "to-stage drop {n}",
    "to-stage flip-bits 1",
    "to-stage double 1",
    "to-stage repeat",
    "to-stage truncate",
    "from-stage lose {ms}ms",
    "from-stage hold {ms}ms",
    "from-stage drip {ms}ms",
    "from-stage drop {n}",
    "from-stage double {n}",
    "from-stage truncate",
    "from-stage flip-bits {n}",
    "from-stage repeat",
    "from-stage reorder",
    "from-stage garbage {n}",
    "rig stiffness {factor}",
];

/// A covering that is missing, soft, stiff, and a stone.
const FACTORS: [&str; 4] = ["0.001", "0.3", "3", "12"];

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
                    .replace("{counts}", &rng.random_range(1..=1200).to_string())
                    .replace("{mm}", &format!("{:.3}", rng.random_range(0.003..0.3)))
                    .replace("{factor}", FACTORS[rng.random_range(0..FACTORS.len())])
                    .replace("{element}", &rng.random_range(0..elements.max(1)).to_string());
                (at, line)
            })
            .collect();
        faults.sort();
        Self { faults }
    }

    /// How far the tip may be from where an honest stage would report it: the greatest lie, and all lost steps of three axes.
    pub fn hidden_mm(&self) -> f64 {
        let (mut lie_mm, mut lost_mm) = (0.0_f64, 0.0);
        for (_, line) in &self.faults {
            match line.parse() {
                Ok(InjectedFault::Stage(StageFault::Controller(ControllerFault::Lie { z_mm }))) => {
                    lie_mm = lie_mm.max(z_mm.abs());
                }
                Ok(InjectedFault::Stage(StageFault::Controller(ControllerFault::LostSteps {
                    lost_mm: mm,
                }))) => {
                    lost_mm += mm * 3_f64.sqrt();
                }
                Ok(_) | Err(_) => {}
            }
        }
        lie_mm + lost_mm
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
