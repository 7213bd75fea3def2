//! Virtual sensor and stage that speak real device bytes, driven by the forward model.
//!
//! [`VirtualRig`] runs both in this process, for the production drivers to connect to, in real or virtual time.
//! [`start_devices`] starts the same devices for other links: [`cable::run`] serves one at a pseudo-terminal, and
//! `tactus-usbip` plugs one into the kernel. Both devices share one world: where the tip truly is, what it presses, and
//! what the elements read. The devices see no more of it than real ones would. What the sensor hides is the rig file's
//! `[simulation]`, or a model or hidden physics in its place ([`TruthFile`]). [`RigControl`] sees all of it, and makes
//! things go wrong ([`faults`]).
//!
//! A [`schedule`] is a script of faults made from a seed.
//!
//! [`UnwiredRig`] is the same world without bytes, for a dry run.
//!
//! Everything random follows from one seed, so that two runs in virtual time are identical to the byte.

pub mod cable;
pub mod faults;
pub mod schedule;

mod control;
mod kinematics;
mod motion;
mod outbox;
mod rig;
mod sensor;
mod sensor_model;
mod stage;
mod terminal;
#[cfg(test)]
mod test_bench;
mod truth;
mod truth_file;
mod twin;
mod unwired;
mod wire;
mod world;

pub use control::{FaultReceivers, RigControl};
pub use rig::{Started, VirtualRig, start_devices};
pub use sensor::VirtualSensor;
pub use stage::VirtualStage;
pub use terminal::TerminalPort;
pub use truth::Truth;
pub use truth_file::{HIDDEN_SCHEMA, TruthError, TruthFile};
pub use twin::{simulation_of, twin_of};
pub use unwired::{UnwiredRig, UnwiredSensor, UnwiredStage};
