//! HID: reports of one length, numbered or not, on a vendor's usage page; Linux offers them as `hidraw`.
//!
//! # Source
//! Device Class Definition for Human Interface Devices 1.11: section 6.2.1 (the HID descriptor), section 6.2.2
//! (report descriptors), section 7.2 (requests). USB 2.0, section 5.7.3: an interrupt endpoint's packets.

use super::{ControlReply, FirstNumbers, Function};
use crate::descriptor::{Class, Endpoint, FunctionDescriptors, IN, Interface, TransferType};
use crate::setup::{Refused, RequestKind, Setup, standard};

const CLASS: Class = Class(3, 0, 0);

const HID_DESCRIPTOR: u8 = 0x21;
const REPORT_DESCRIPTOR: u8 = 0x22;

const GET_REPORT: u8 = 0x01;
const GET_IDLE: u8 = 0x02;
const SET_REPORT: u8 = 0x09;
const SET_IDLE: u8 = 0x0A;

/// The longest report that one packet of an interrupt endpoint carries, at high speed.
pub const REPORT_BYTES_MAX: u16 = 1024;

/// Every 8 microframes of 125 us: once a millisecond.
const INTERVAL: u8 = 4;

/// A device that sends reports. Each packet is a report; numbered reports begin with their number.
#[derive(Debug)]
pub(crate) struct Hid {
    /// Length of a report, its number included.
    report_bytes: u16,
    descriptor: Vec<u8>,
    last: Vec<u8>,
}

impl Hid {
    /// Reports of this many bytes, their number included; 1 to [`REPORT_BYTES_MAX`].
    pub(crate) fn new(report_bytes: u16, number: Option<u8>) -> Self {
        let descriptor = report_descriptor(report_bytes, number);
        Self { report_bytes, descriptor, last: vec![0; report_bytes.into()] }
    }

    fn hid_descriptor(&self) -> Vec<u8> {
        let mut bytes = vec![9, HID_DESCRIPTOR, 0x11, 0x01, 0, 1, REPORT_DESCRIPTOR];
        bytes.extend(u16::try_from(self.descriptor.len()).unwrap_or(u16::MAX).to_le_bytes());
        bytes
    }
}

/// One input report of bytes that only the vendor defines.
fn report_descriptor(report_bytes: u16, number: Option<u8>) -> Vec<u8> {
    let [low, high] = (report_bytes - u16::from(number.is_some())).to_le_bytes();
    let mut bytes = vec![0x06, 0x00, 0xFF]; // Usage page: the vendor's.
    bytes.extend([0x09, 0x01]); // Usage: 1.
    bytes.extend([0xA1, 0x01]); // Collection: application.
    if let Some(number) = number {
        bytes.extend([0x85, number]); // Report id.
    }
    bytes.extend([0x09, 0x01]); // Usage: 1.
    bytes.extend([0x15, 0x00]); // Logical minimum: 0.
    bytes.extend([0x26, 0xFF, 0x00]); // Logical maximum: 255.
    bytes.extend([0x75, 0x08]); // Report size: 8 bits.
    bytes.extend([0x96, low, high]); // Report count.
    bytes.extend([0x81, 0x02]); // Input: data, variable, absolute.
    bytes.push(0xC0); // End of the collection.
    bytes
}

impl Function for Hid {
    fn group(&self, FirstNumbers { interface, endpoint }: FirstNumbers) -> FunctionDescriptors {
        let carrier = TransferType::Interrupt { interval: INTERVAL };
        let reports = Endpoint { address: IN | endpoint, carrier, packet_bytes: self.report_bytes };
        let interface = Interface {
            number: interface,
            class: CLASS,
            class_descriptors: self.hid_descriptor(),
            endpoints: vec![reports],
        };
        FunctionDescriptors { interfaces: vec![interface] }
    }

    fn control(&mut self, setup: Setup, data: &[u8]) -> Result<ControlReply, Refused> {
        match (setup.kind(), setup.request) {
            (Some(RequestKind::Standard), standard::GET_DESCRIPTOR) => match setup.descriptor() {
                (HID_DESCRIPTOR, 0) => Ok(ControlReply::Data(self.hid_descriptor())),
                (REPORT_DESCRIPTOR, 0) => Ok(ControlReply::Data(self.descriptor.clone())),
                _ => Err(Refused),
            },
            (Some(RequestKind::Class), GET_REPORT) => Ok(ControlReply::Data(self.last.clone())),
            (Some(RequestKind::Class), GET_IDLE) => Ok(ControlReply::Data(vec![0])),
            (Some(RequestKind::Class), SET_IDLE) => Ok(ControlReply::DONE),
            (Some(RequestKind::Class), SET_REPORT) => Ok(ControlReply::Heard(data.to_vec())),
            _ => Err(Refused),
        }
    }

    fn packets(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        // The device behind sends whole reports.
        let reports = bytes.chunks_exact(self.report_bytes.into());
        let packets: Vec<_> = reports.map(<[u8]>::to_vec).collect();
        if let Some(last) = packets.last() {
            self.last.clone_from(last);
        }
        packets
    }
}

#[cfg(test)]
#[path = "hid_tests.rs"]
mod tests;
