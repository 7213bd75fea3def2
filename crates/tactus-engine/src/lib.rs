//! The run engine.
//!
//! An [`Engine`] owns a rig's devices for the life of the service. The acquisition task passes each frame to the
//! safety supervisor, then to the recording, then to the run's averages, then to the viewers. A run executes one
//! experiment script: every step is checked against the rig's envelope before anything moves, and the tip is retracted
//! before the run ends, whatever ended it.

mod acquisition;
mod average;
mod clock_watch;
mod engine;
mod envelope;
mod motion;
mod outlet;
mod reset;
mod run;
mod script;
mod waiting;

pub use engine::{
    Busy, ChangeCovering, Claim, CoveringMemory, Devices, Engine, EngineError, Pulse, ResetError,
    ResumeError, StopOrder, Stopped,
};
pub use envelope::{Bounds, Outside};
pub use outlet::{Publish, Record, RecordFailure, Unpublished, Unrecorded};
pub use run::{DoneStep, EarlierRun, Planned, RunOrder, RunOutcome};
pub use tactus_safety::{Fault, Violation};
