//! What conversations with stages have in common, whatever the protocol: what they are asked, what they want done
//! and tell, and when a move is done.
//!
//! Each protocol's [`Session`] keeps to the same promises: one command at a time, a stop that goes before
//! everything, a move that is done only when the controller stands within tolerance of the target, and a position
//! that counts as known only from homing on until something casts doubt on it.

mod action;
mod arrival;
mod axis;
mod session;

pub use action::{Action, Alarm, Cause, Controller, Failure, Report, Setting, Status};
pub use axis::{AxisName, Direction};
pub use session::Session;

pub(crate) use arrival::{ArrivalCheck, Judgement};
pub(crate) use axis::distance_mm;
