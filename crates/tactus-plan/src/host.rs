//! The interface between a script and the host that performs its steps.

use std::fmt;
use std::num::NonZeroU32;

use serde::{Deserialize, Serialize};

use crate::Step;

/// Performs the steps of a script: the run engine on a rig, or a test.
pub trait Host {
    /// Performs one step and returns the result. The script waits meanwhile.
    ///
    /// # Errors
    /// [`Refusal`] if the step was not done; it ends the script at the line of the call.
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal>;

    /// True once the run must end. Polled while the script computes.
    fn cancelled(&self) -> bool;
}

/// A step and the line of the script that asks for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Call {
    /// What to do, not yet checked against the envelope.
    pub step: Step,
    /// The innermost line of the script.
    pub at: Location,
}

/// A place in a script, displayed as `corners.star:12`, or `corners.star:12:5` with its column.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Location {
    /// The script's name, without the suffix.
    pub script: String,
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1, where it is known.
    pub column: Option<NonZeroU32>,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.star:{}", self.script, self.line)?;
        self.column.map_or(Ok(()), |column| write!(f, ":{column}"))
    }
}

/// The result of a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// Done, without a result.
    Done,
    /// A press: one reading for each of its depths, in their order.
    Pressed(Vec<MeanReading>),
    /// A dwell, a read or a tare.
    Reading(MeanReading),
    /// A move: where the tip is now, in the sensor frame.
    Position {
        /// Along a row of elements.
        x_mm: f64,
        /// Along a column of elements.
        y_mm: f64,
        /// Above the covering's nominal surface.
        height_mm: f64,
    },
}

/// The mean over some frames; one number per element, row-major.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct MeanReading {
    /// Raw counts, averaged.
    pub mean_counts: Vec<f64>,
    /// `mean_counts` above the last tare; before any tare, above the run's own reading at rest.
    pub signal: Vec<f64>,
    /// Standard deviation of the counts over the averaged frames.
    pub rms: Vec<f64>,
    /// Number of frames averaged.
    pub frames: u32,
}

/// Why a step was not performed. The text is for a person and is displayed after the script's line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error, Serialize, Deserialize)]
pub enum Refusal {
    /// The step leaves the rig's envelope; nothing moved.
    #[error("{0}")]
    Outside(String),
    /// The run was stopped.
    #[error("{0}")]
    Stopped(String),
    /// The rig could not perform it.
    #[error("{0}")]
    Failed(String),
}
