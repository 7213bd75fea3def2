//! Functions: what a USB device is to the host's drivers.

pub(super) mod acm;
pub(super) mod bulk;
pub(super) mod ftdi;
pub(super) mod hid;

use std::time::Duration;

use super::descriptor::Group;
use super::setup::{Refused, Setup};

/// The first numbers that are a function's own within its device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    /// Of its interfaces.
    pub(super) interface: u8,
    /// Of its endpoints: on this one it sends its data.
    pub(super) endpoint: u8,
}

/// What a function makes of a request of its class, or of its vendor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Reply {
    /// An answer; empty where the host only tells something.
    Data(Vec<u8>),
    /// Bytes for the device behind.
    Heard(Vec<u8>),
}

impl Reply {
    /// The host told something, which is done.
    pub(super) const DONE: Self = Self::Data(Vec::new());
}

/// One function of a USB device. What its data endpoint hears goes to the device behind as it is.
pub(super) trait Function: Send {
    /// Its interfaces and endpoints. Every call gives the same, but for the place.
    fn group(&self, place: Place) -> Group;

    /// A request of its class or vendor, or for a descriptor of its class; `data` are the host's.
    ///
    /// # Errors
    /// What it does not know.
    fn control(&mut self, setup: Setup, data: &[u8]) -> Result<Reply, Refused>;

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
