//! Virtual sensor and stage that speak real device bytes, driven by the forward model.
//!
//! [`VirtualRig`] runs both in this process, for the production drivers to connect to, in real or virtual
//! time; the program `tactus-mock` serves the same devices at pseudo-terminals, or plugs them into the kernel
//! as USB devices. Behind both stands one world: where the tip truly is, what it presses, what the elements feel. The devices see no more of it
//! than real ones would. What they feel is the rig file's `[simulation]`, or a model or hidden
//! physics in its place ([`TruthFile`]). [`RigControl`] sees all of it, and makes things go wrong ([`faults`]).
//!
//! [`hidden`] makes test data for discovery: sensors with physics that the base model does not know.
//!
//! Everything random follows from one seed, so that two runs in virtual time are identical to the byte.

pub mod cli;
pub mod faults;
pub mod hidden;

#[cfg(test)]
mod bench;
mod cable;
mod control;
mod feel;
mod kinematics;
mod motion;
mod outbox;
mod rig;
mod sensor;
mod stage;
mod terminal;
mod truth;
mod truth_file;
mod twin;
mod usb;
mod world;

pub use control::RigControl;
pub use rig::VirtualRig;
pub use truth::Truth;
pub use truth_file::{HIDDEN_SCHEMA, TruthError, TruthFile};
pub use twin::twin_of;
