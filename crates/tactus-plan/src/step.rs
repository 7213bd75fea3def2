//! What a script may ask for.

/// One thing that a script asks for. Positions are in the sensor frame (the rig's registration maps
/// them to the robot's), heights above the covering's nominal surface, depths below it.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Travel to a place at a height, up first and down last.
    Move {
        /// Where.
        to: Position,
        /// Height above the surface; the rig's safe height if `None`.
        height_mm: Option<f64>,
        /// Speed; the rig's travel speed if `None`.
        speed_mm_per_s: Option<f64>,
    },
    /// One press.
    Press(Press),
    /// Stay and average readings for a time, as a dwell of the press in hand or outside one.
    Dwell {
        /// For how long.
        duration_s: f64,
    },
    /// Average the readings of a time, without the settling pause of a dwell.
    Read {
        /// For how long.
        duration_s: f64,
    },
    /// Take the present reading as the zero of later reads. Not while pressing.
    Tare {
        /// For how long readings are averaged.
        duration_s: f64,
    },
    /// Let time pass.
    Wait {
        /// For how long.
        duration_s: f64,
    },
    /// Write a line into the run's events.
    Log {
        /// The line.
        message: String,
    },
    /// Have another covering put in place. A simulated rig changes it itself; a real one asks and waits.
    Covering {
        /// Thickness of the new covering.
        thickness_mm: f64,
    },
}

/// A place in the plane, sensor frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Along a row of elements.
    pub x_mm: f64,
    /// Along a column of elements.
    pub y_mm: f64,
}

/// One contact at one place: approach, load through the depths with a dwell at each, unload, retract.
#[derive(Debug, Clone, PartialEq)]
pub struct Press {
    /// Where.
    pub at: Position,
    /// Depths below the surface in the order they are held; going up is allowed (a load-unload ladder).
    pub depths_mm: Vec<f64>,
    /// How long readings are averaged at each depth.
    pub dwell_s: f64,
    /// Speed of loading and unloading; the rig's load speed if `None`.
    pub speed_mm_per_s: Option<f64>,
    /// Sideways distance from which the tip comes to the place at the approach height, so that the direction
    /// of approach is known; straight from where it was if `None`.
    pub approach_from_mm: Option<[f64; 2]>,
}
