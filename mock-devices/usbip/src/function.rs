//! Functions: the roles of a USB device for the host's drivers.

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

/// A function's first interface and endpoint numbers within its device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FirstNumbers {
    /// Its first interface.
    pub(crate) interface: u8,
    /// Its first endpoint, on which it sends its data.
    pub(crate) endpoint: u8,
}

/// A function's answer to a request of its class or vendor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ControlReply {
    /// Data for the host; empty if the host only sends something.
    Data(Vec<u8>),
    /// Bytes for the device behind.
    Heard(Vec<u8>),
}

impl ControlReply {
    /// The request is done and has no data.
    pub(crate) const DONE: Self = Self::Data(Vec::new());
}

/// One function of a USB device. Bytes that its data endpoint receives go unchanged to the device behind it.
pub(crate) trait Function: Send {
    /// Its interfaces and endpoints. Every call returns the same, except for the numbers.
    fn group(&self, place: FirstNumbers) -> FunctionDescriptors;

    /// Answers a request of its class or vendor, or for a descriptor of its class; `data` is from the host.
    ///
    /// # Errors
    /// [`Refused`] for an unknown request.
    fn control(&mut self, setup: Setup, data: &[u8]) -> Result<ControlReply, Refused>;

    /// Makes packets for the host from bytes of the device behind it.
    fn packets(&mut self, bytes: &[u8]) -> Vec<Vec<u8>>;

    /// False while no host has opened it: then bytes of the device are lost, as with real devices.
    fn is_open(&self) -> bool {
        true
    }

    /// The packet that it sends if a host has waited this long without data.
    fn idle_packet(&self) -> Option<(Duration, Vec<u8>)> {
        None
    }
}

/// The kind of a function, with its parameters.
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
