//! The tactile array.
//!
//! One driver reads every array. It connects, reconnects, numbers frames and reports losses. The protocol itself is a
//! [`tactus_wire::sensor::Session`], which a [`SensorCodec`] makes for each connection.

mod codec;
mod driver;
mod link_file;
mod sequence;

use std::task::{Context, Poll};

use tactus_schema::{Frame, pb};

use crate::DeviceError;

pub use codec::SensorCodec;
pub use driver::{ArrayExpectation, SensorDriver};
pub use link_file::{LinkFile, LinkFileError};

/// A tactile array that is being read. One task owns it.
pub trait Sensor: Send {
    /// The next event, once there is one; until then the task is woken as by a future. There is no last one: a lost device is
    /// searched for with growing pauses.
    fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<SensorEvent>;
}

/// An event of a sensor.
#[derive(Debug)]
pub enum SensorEvent {
    /// The device answered and frames follow. Also comes after each loss.
    Connected(Box<pb::SensorInfo>),
    /// Frames are missing; comes just before the frame that follows the gap.
    Gap(pb::Gap),
    /// One reading.
    Frame(Frame),
    /// The device is gone, silent or sends something else. The driver keeps trying. Comes once for each change of kind.
    Lost(DeviceError),
}
