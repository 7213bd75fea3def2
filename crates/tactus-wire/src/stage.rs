//! What all stage sessions share: the trait, its actions, axes, and the check that a move has arrived.
//!
//! Every [`Session`] guarantees the same: there is one command at a time; a stop precedes everything else; a move is done
//! only when the controller stands within tolerance of the target; a move whose reports leave its way, or are ahead of its
//! speed, is stopped; and the position counts as known only from homing
//! until an event makes it doubtful.
//!
//! To add a stage protocol: add a module to this crate with a type that implements [`Session`]; an arm to
//! `tactus_device::DrivenStage::start`; the protocol's name and keys to `tactus_schema::rig::StageProtocol`; and a virtual
//! stage to `mock-devices`.

mod action;
mod arrival;
mod axis;
mod course;
mod session;

pub use action::{Action, Alarm, Cause, Controller, Failure, Report, Setting, Status, Whereabouts};
pub use axis::{AxisName, Direction};
pub use session::Session;

pub(crate) use arrival::{ArrivalCheck, Judgement};
pub(crate) use axis::distance_mm;
pub(crate) use course::{Course, Shape};
