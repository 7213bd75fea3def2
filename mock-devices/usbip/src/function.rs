//! Functions: what a USB device is to the host's drivers.

pub(crate) mod acm;
pub(crate) mod bulk;
pub(crate) mod ftdi;
pub(crate) mod hid;

use std::time::Duration;

use acm::Acm;
use bulk::Bulk;
use ftdi::Ftdi;
use hid::Hid;

use crate::descriptor::{FunctionDescriptors, Speed};
use crate::setup::{Refused, Setup};

/// The first numbers that are a function's own within its device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FirstNumbers {
    /// Of its interfaces.
    pub(crate) interface: u8,
    /// Of its endpoints: on this one it sends its data.
    pub(crate) endpoint: u8,
}

/// What a function makes of a request of its class, or of its vendor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ControlReply {
    /// An answer; empty where the host only tells something.
    Data(Vec<u8>),
    /// Bytes for the device behind.
    Heard(Vec<u8>),
}

impl ControlReply {
    /// The host told something, which is done.
    pub(crate) const DONE: Self = Self::Data(Vec::new());
}

/// One function of a USB device. What its data endpoint hears goes to the device behind as it is.
pub(crate) trait Function: Send {
    /// Its interfaces and endpoints. Every call gives the same, but for the place.
    fn group(&self, place: FirstNumbers) -> FunctionDescriptors;

    /// A request of its class or vendor, or for a descriptor of its class; `data` are the host's.
    ///
    /// # Errors
    /// What it does not know.
    fn control(&mut self, setup: Setup, data: &[u8]) -> Result<ControlReply, Refused>;

    /// Makes packets for the host of what the device behind sends.
    fn packets(&mut self, bytes: &[u8]) -> Vec<Vec<u8>>;

    /// False while no host has opened it: what the device sends is then lost, as real ones have it.
    fn is_open(&self) -> bool {
        true
    }

    /// What it sends when a host has asked and for so long there was nothing.
    fn idle_packet(&self) -> Option<(Duration, Vec<u8>)> {
        None
    }
}

/// What kind of function a device has, with all that making it needs.
#[derive(Debug, Clone)]
pub enum FunctionKind {
    /// A serial port by USB's own class, CDC-ACM.
    Acm,
    /// A serial port by FTDI's chip.
    Ftdi,
    /// Reports, each a frame.
    Hid {
        /// Bytes of a report, its number included; at most [`REPORT_BYTES_MAX`](hid::REPORT_BYTES_MAX).
        report_bytes: u16,
        /// The report's number; `None` for reports without one.
        number: Option<u8>,
    },
    /// A vendor's bulk endpoint; each transfer is a frame.
    Bulk {
        /// Bytes of a frame.
        frame_bytes: usize,
    },
}

impl FunctionKind {
    pub(crate) fn speed(&self) -> Speed {
        match self {
            Self::Ftdi => Ftdi::SPEED,
            Self::Acm | Self::Hid { .. } | Self::Bulk { .. } => Speed::High,
        }
    }

    pub(crate) fn function(&self) -> Box<dyn Function> {
        match *self {
            Self::Acm => Box::new(Acm::new(self.speed())),
            Self::Ftdi => Box::new(Ftdi::new()),
            Self::Hid { report_bytes, number } => Box::new(Hid::new(report_bytes, number)),
            Self::Bulk { frame_bytes } => Box::new(Bulk::new(self.speed(), frame_bytes)),
        }
    }
}

/// Packets of at most `packet_bytes`, the last of them shorter, so that the host's transfer ends there: empty if
/// need be (USB 2.0, section 5.8.3).
fn ended_by_short(bytes: &[u8], packet_bytes: u16) -> Vec<Vec<u8>> {
    let packet_bytes = usize::from(packet_bytes);
    let mut packets: Vec<_> = bytes.chunks(packet_bytes).map(<[u8]>::to_vec).collect();
    if packets.last().is_some_and(|last| last.len() == packet_bytes) {
        packets.push(Vec::new());
    }
    packets
}
