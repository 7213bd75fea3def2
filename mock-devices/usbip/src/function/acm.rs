//! CDC-ACM: a serial port by USB's own class; Linux calls it `ttyACM`.
//!
//! # Source
//! Class Definitions for Communication Devices 1.2, section 5.2.3 (functional descriptors), and its PSTN subclass
//! 1.2: section 5.3 (descriptors), table 13 (requests), table 17 (line coding).

use super::{ControlReply, FirstNumbers, Function, ended_by_short};
use crate::descriptor::{Class, Endpoint, FunctionDescriptors, IN, Interface, Speed, TransferType};
use crate::setup::{Refused, Setup};

const COMMUNICATION: Class = Class(2, 2, 1);
const DATA: Class = Class(10, 0, 0);

const SET_LINE_CODING: u8 = 0x20;
const GET_LINE_CODING: u8 = 0x21;
const SET_CONTROL_LINE_STATE: u8 = 0x22;
const SEND_BREAK: u8 = 0x23;

/// Data terminal ready: a program has opened the port.
const DTR: u16 = 1;

/// 115200 baud, 1 stop bit, no parity, 8 data bits.
const LINE_CODING: [u8; 7] = [0x00, 0xC2, 0x01, 0x00, 0, 0, 8];

/// A serial port. The line's speed is stored but has no effect: there is no real line.
#[derive(Debug)]
pub(crate) struct Acm {
    packet_bytes: u16,
    line_coding: [u8; 7],
    is_open: bool,
}

impl Acm {
    /// A port that nobody has opened.
    pub(crate) fn new(speed: Speed) -> Self {
        Self { packet_bytes: speed.bulk_packet_bytes(), line_coding: LINE_CODING, is_open: false }
    }
}

impl Function for Acm {
    fn group(&self, FirstNumbers { interface, endpoint }: FirstNumbers) -> FunctionDescriptors {
        let data = interface + 1;
        let class_descriptors = [
            // Header: release 1.10 of the class.
            &[5, 0x24, 0, 0x10, 0x01][..],
            // Call management: none.
            &[5, 0x24, 1, 0, data],
            // Abstract control management: line coding and state.
            &[4, 0x24, 2, 0x02],
            // Union of both interfaces.
            &[5, 0x24, 6, interface, data],
        ];
        let notifications = Endpoint {
            address: IN | (endpoint + 1),
            carrier: TransferType::Interrupt { interval: 9 },
            packet_bytes: 16,
        };
        let bulk =
            |address| Endpoint { address, carrier: TransferType::Bulk, packet_bytes: self.packet_bytes };
        FunctionDescriptors {
            interfaces: vec![
                Interface {
                    number: interface,
                    class: COMMUNICATION,
                    class_descriptors: class_descriptors.concat(),
                    endpoints: vec![notifications],
                },
                Interface {
                    number: data,
                    class: DATA,
                    class_descriptors: Vec::new(),
                    endpoints: vec![bulk(IN | endpoint), bulk(endpoint)],
                },
            ],
        }
    }

    fn control(&mut self, setup: Setup, data: &[u8]) -> Result<ControlReply, Refused> {
        match setup.request {
            SET_LINE_CODING => {
                self.line_coding = data.try_into().map_err(|_| Refused)?;
                Ok(ControlReply::DONE)
            }
            GET_LINE_CODING => Ok(ControlReply::Data(self.line_coding.to_vec())),
            SET_CONTROL_LINE_STATE => {
                self.is_open = setup.value & DTR != 0;
                Ok(ControlReply::DONE)
            }
            SEND_BREAK => Ok(ControlReply::DONE),
            _ => Err(Refused),
        }
    }

    fn packets(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        ended_by_short(bytes, self.packet_bytes)
    }

    fn is_open(&self) -> bool {
        self.is_open
    }
}

#[cfg(test)]
#[path = "acm_tests.rs"]
mod tests;
