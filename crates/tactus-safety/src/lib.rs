//! The safety supervisor. Frames, stage reports, times and orders go in; permits, stops and refusals come out.
//!
//! No stage moves without a [`Permit`], and only a [`Supervisor`] makes permits. A permit for a step down is valid for one
//! sample period. A permit is void once anything was stopped, moved or permitted after it was given. When a rule is broken the supervisor returns a
//! [`Violation`], voids all permits, and gives only permits for the way up until a reset.
//!
//! There is no I/O, no clock and no other task here: the caller stops the stage when it receives a violation.

mod contact;
mod fault;
mod force;
mod lateness;
mod limits;
mod permit;
mod supervisor;

pub use fault::{Fault, Violation};
pub use limits::{SAME_HEIGHT_MM, STEP_DOWN_MAX_MM};
pub use permit::{Denied, HomingPermit, Permit, Revocation, Target, Void};
pub use supervisor::Supervisor;
