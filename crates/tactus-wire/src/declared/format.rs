//! The checked description.

use super::checksum::Algorithm;
use super::raw::{Framing, RawHid, RawUsb};
use super::{Field, Samples};

/// Greatest length of a frame.
pub const MAX_FRAME_BYTES: usize = 65_536;

/// A format that can be decoded: a [`RawFormat`](super::RawFormat) without contradictions.
#[derive(Debug, Clone, PartialEq)]
pub struct Format {
    pub(super) name: String,
    pub(super) framing: Framing,
    pub(super) bytes: usize,
    /// The bytes at the beginning of every frame: the report id, then the sync bytes.
    pub(super) head: Vec<u8>,
    pub(super) trailer: Vec<u8>,
    pub(super) length: Option<Length>,
    pub(super) samples: Samples,
    pub(super) sequence: Option<Sequence>,
    pub(super) timestamp: Option<Timestamp>,
    pub(super) checksum: Option<Checksum>,
    pub(super) hid: Option<RawHid>,
    pub(super) usb: Option<RawUsb>,
}

/// A field with the frame's length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Length {
    pub(super) field: Field,
    /// Its value in every frame.
    pub(super) value: u64,
}

/// The device's count of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sequence {
    pub(super) field: Field,
    pub(super) wrap: u128,
}

/// The device's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timestamp {
    pub(super) field: Field,
    pub(super) wrap: u128,
    pub(super) tick_ns: f64,
    pub(super) unchanged_is_stale: bool,
}

/// The checksum of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Checksum {
    pub(super) algorithm: Algorithm,
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) field: Field,
}

/// A contradiction in a description.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {problem}")]
pub struct FormatError {
    /// The field's path in the file, such as `samples.offset`.
    pub field: String,
    /// What is wrong, and what to do.
    pub problem: String,
}

impl Format {
    /// Name of the device that is described.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether bytes arrive as a stream or in packets.
    pub fn framing(&self) -> Framing {
        self.framing
    }

    /// Length of a frame in bytes.
    pub fn frame_bytes(&self) -> usize {
        self.bytes
    }

    /// How a frame holds the elements' values.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Length of the device clock's tick in ns, if it has a clock.
    pub fn tick_ns(&self) -> Option<f64> {
        self.timestamp.map(|timestamp| timestamp.tick_ns)
    }

    /// Length of the device clock's tick in ns, and number of ticks after which it starts again at 0, if it has a clock.
    pub fn clock(&self) -> Option<(f64, u128)> {
        self.timestamp.map(|timestamp| (timestamp.tick_ns, timestamp.wrap))
    }

    /// Number of frames after which the frame count starts again at 0, if there is one; saturates.
    pub fn sequence_wrap(&self) -> Option<u64> {
        self.sequence.map(|sequence| u64::try_from(sequence.wrap).unwrap_or(u64::MAX))
    }

    /// The HID report id, if the device is a HID; 0 if its reports have none.
    pub fn hid_report_id(&self) -> Option<u8> {
        self.hid.map(|hid| hid.report_id)
    }

    /// USB interface number and endpoint address, if the description has them.
    pub fn usb_interface_and_endpoint(&self) -> Option<(u8, u8)> {
        self.usb.map(|usb| (usb.interface, usb.endpoint))
    }
}
