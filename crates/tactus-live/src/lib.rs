//! What a live view of a rig keeps: the log, the zero in force, the frames of the last minutes.
//!
//! The terminal's view and the dashboard's pages show the same numbers, because both keep them here. There is no I/O and no clock: messages
//! come in, in the order in which the bus gives them.

mod history;
mod log;
mod zero;

pub use history::{History, Moment, Order};
pub use log::{Entry, Log, Weight};
pub use zero::{TAKEN_FRAMES, Zero, ZeroSource};
