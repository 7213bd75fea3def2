//! The steps that a script can ask for.

use serde::{Deserialize, Serialize};

/// One step of a script. Positions are in the sensor frame (the rig's registration maps them to the robot frame),
/// heights are above the covering's nominal surface, depths below it; all in mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Step {
    /// Travel to a position and height: first up, then sideways, last down.
    Move {
        /// Target.
        to: Position,
        /// Height above the surface; the rig's safe height if `None`.
        height_mm: Option<f64>,
        /// Speed; the rig's travel speed if `None`.
        speed_mm_per_s: Option<f64>,
    },
    /// One press.
    Press(Press),
    /// Stay, let the reading settle, and average for a time.
    Dwell {
        /// Averaging time.
        duration_s: f64,
    },
    /// Average readings at once, without the settling time of a dwell.
    Read {
        /// Averaging time.
        duration_s: f64,
    },
    /// Take the present reading as the zero of later reads. Not while pressing.
    Tare {
        /// Averaging time.
        duration_s: f64,
    },
    /// Let time pass.
    Wait {
        /// Waiting time.
        duration_s: f64,
    },
    /// Write a line into the run's events.
    Log {
        /// Text for the run log, at most 4 KiB.
        message: String,
    },
    /// Have another covering put in place. A simulated rig changes it itself; a real one asks and waits.
    Covering {
        /// Thickness of the new covering.
        thickness_mm: f64,
    },
}

/// A position in the plane, sensor frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// Along a row of elements.
    pub x_mm: f64,
    /// Along a column of elements.
    pub y_mm: f64,
}

/// One contact at one position: approach, load through the depths with a dwell at each, unload, retract.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Press {
    /// Position of the contact.
    pub at: Position,
    /// Depths below the surface in the order in which they are held. They may decrease, as in a load-unload ladder.
    pub depths_mm: Vec<f64>,
    /// Averaging time at each depth.
    pub dwell_s: f64,
    /// Speed of loading and unloading; the rig's load speed if `None`.
    pub speed_mm_per_s: Option<f64>,
    /// Offset along x and y from which the tip approaches the position at the approach height, so that the direction of
    /// approach is known. `None`: straight from its last position.
    pub approach_from_mm: Option<[f64; 2]>,
}
