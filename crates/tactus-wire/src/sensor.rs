//! What all sensor sessions share: the trait, its actions, and a reading.
//!
//! A [`Session`] is the host's side of one protocol over one connection. `tactus-device` has one driver that runs
//! any of them over any transport.
//!
//! To add a sensor format:
//! 1. add a module to this crate with a decoder and a type that implements [`Session`];
//! 2. add a variant and one arm in the factory, `tactus_device::SensorCodec`;
//! 3. add the protocol's name and keys to the rig schema, `tactus_schema::rig::SensorProtocol`;
//! 4. let the virtual sensor in `mock-devices` speak it, for tests without the device.
//!
//! A device that streams frames of one fixed length needs no code: [`declared`](crate::declared) reads its format from
//! a file.

mod action;
mod memory;
mod reading;
mod session;
mod watchdog;

pub use action::{Action, Cause, Loss};
pub use reading::{LossEvidence, Reading};
pub use session::Session;

pub(crate) use memory::Memory;
pub(crate) use watchdog::{NO_FRAME_AFTER, SILENT_AFTER, StreamFault, Watchdog};

/// A tick's length for [`Session::tick_ns`].
pub(crate) fn whole_ns(tick: core::time::Duration) -> u64 {
    u64::try_from(tick.as_nanos()).unwrap_or(u64::MAX)
}
