//! Vendor bulk: a pair of endpoints with an interface of the vendor's class, for programs that use USB directly.
//!
//! Each frame is one transfer, which a short packet ends.
//!
//! # Source
//! USB 2.0, section 5.8.

use super::{ControlReply, FirstNumbers, Function, ended_by_short};
use crate::descriptor::{Class, Endpoint, FunctionDescriptors, IN, Interface, Speed, TransferType};
use crate::setup::{Refused, Setup};

/// Frames at a bulk endpoint.
#[derive(Debug)]
pub(crate) struct Bulk {
    packet_bytes: u16,
    frame_bytes: usize,
}

impl Bulk {
    /// Frames of this many bytes, at least 1.
    pub(crate) fn new(speed: Speed, frame_bytes: usize) -> Self {
        Self { packet_bytes: speed.bulk_packet_bytes(), frame_bytes }
    }
}

impl Function for Bulk {
    fn group(&self, FirstNumbers { interface, endpoint }: FirstNumbers) -> FunctionDescriptors {
        let bulk =
            |address| Endpoint { address, carrier: TransferType::Bulk, packet_bytes: self.packet_bytes };
        let interface = Interface {
            number: interface,
            class: Class::VENDOR,
            class_descriptors: Vec::new(),
            endpoints: vec![bulk(IN | endpoint), bulk(endpoint)],
        };
        FunctionDescriptors { interfaces: vec![interface] }
    }

    fn control(&mut self, _setup: Setup, _data: &[u8]) -> Result<ControlReply, Refused> {
        Err(Refused)
    }

    fn packets(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        bytes.chunks(self.frame_bytes).flat_map(|frame| ended_by_short(frame, self.packet_bytes)).collect()
    }
}

#[cfg(test)]
#[path = "bulk_tests.rs"]
mod tests;
