//! The tactile array.
//!
//! One driver reads every array. It connects, reconnects, numbers frames and reports losses. The protocol itself is a
//! [`tactus_wire::sensor::Session`], which a [`SensorCodec`] makes for each connection.

mod codec;
mod driver;
mod link_file;
mod sequence;

use futures_util::future::BoxFuture;
use tactus_schema::{Frame, pb};

use crate::DeviceError;

pub use codec::SensorCodec;
pub use driver::{ArrayExpectation, SensorDriver};
pub use link_file::{LinkFile, LinkFileError};

/// A tactile array that is being read. One task owns it.
pub trait Sensor: Send {
    /// Waits for what comes next. Never ends: a lost device is waited for, with growing pauses.
    ///
    /// Cancel-safe: an event that is not returned is not lost.
    fn next(&mut self) -> BoxFuture<'_, SensorEvent>;
}

/// What a sensor tells.
#[derive(Debug)]
pub enum SensorEvent {
    /// The device answered and frames are to follow. The first event, and one after each loss.
    Connected(pb::SensorInfo),
    /// Frames were lost; comes just before the frame that follows the gap.
    Gap(pb::Gap),
    /// One reading.
    Frame(Frame),
    /// The device has gone or speaks nonsense; it is being looked for. Told once for each change of kind.
    Lost(DeviceError),
}
