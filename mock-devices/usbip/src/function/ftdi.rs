//! FTDI's FT232R: the serial port of most adapters; Linux calls it `ttyUSB`.
//!
//! The chip puts two status bytes in front of every packet. Without other data it sends them alone each time the latency
//! timer runs out. Its requests are the vendor's; the host identifies the chip by its vendor and product numbers.
//!
//! # Source
//! FTDI's application note AN232B-04 (packets, status bytes, latency timer) and the requests as the Linux kernel's
//! `drivers/usb/serial/ftdi_sio.h` documents them.

use std::time::Duration;

use super::{ControlReply, FirstNumbers, Function};
use crate::descriptor::{Class, Endpoint, FunctionDescriptors, IN, Interface, Speed, TransferType};
use crate::setup::{Refused, RequestKind, Setup};

const RESET: u8 = 0;
const SET_MODEM_CTRL: u8 = 1;
const SET_FLOW_CTRL: u8 = 2;
const SET_BAUD_RATE: u8 = 3;
const SET_DATA: u8 = 4;
const GET_MODEM_STATUS: u8 = 5;
const SET_EVENT_CHAR: u8 = 6;
const SET_ERROR_CHAR: u8 = 7;
const SET_LATENCY_TIMER: u8 = 9;
const GET_LATENCY_TIMER: u8 = 0x0A;
const SET_BITMODE: u8 = 0x0B;
const READ_EEPROM: u8 = 0x90;

/// In the value of [`SET_MODEM_CTRL`]: data terminal ready, and that it is meant.
const DTR: u16 = 0x0001;
const DTR_MEANT: u16 = 0x0100;

/// The modem's: a fixed bit, clear to send and data set ready. The line's: all has been sent.
const STATUS: [u8; 2] = [0x31, 0x60];

/// Content of an empty memory.
const ERASED: [u8; 2] = [0xFF, 0xFF];

const LATENCY_MS: u8 = 16;

/// The chip. The line's speed has no effect: there is no real line.
#[derive(Debug)]
pub(crate) struct Ftdi {
    latency_ms: u8,
    is_open: bool,
}

impl Ftdi {
    /// The chip is full speed only.
    pub(crate) const SPEED: Speed = Speed::Full;
    /// FTDI's FT232R.
    pub(crate) const VENDOR: u16 = 0x0403;
    pub(crate) const PRODUCT: u16 = 0x6001;
    /// Identifies the chip among the vendor's others.
    pub(crate) const RELEASE: u16 = 0x0600;

    /// A port that nobody has opened.
    pub(crate) fn new() -> Self {
        Self { latency_ms: LATENCY_MS, is_open: false }
    }
}

impl Function for Ftdi {
    fn group(&self, FirstNumbers { interface, endpoint }: FirstNumbers) -> FunctionDescriptors {
        let packet_bytes = Self::SPEED.bulk_packet_bytes();
        let bulk = |address| Endpoint { address, carrier: TransferType::Bulk, packet_bytes };
        let interface = Interface {
            number: interface,
            class: Class::VENDOR,
            class_descriptors: Vec::new(),
            endpoints: vec![bulk(IN | endpoint), bulk(endpoint + 1)],
        };
        FunctionDescriptors { interfaces: vec![interface] }
    }

    fn control(&mut self, setup: Setup, _data: &[u8]) -> Result<ControlReply, Refused> {
        if setup.kind() != Some(RequestKind::Vendor) {
            return Err(Refused);
        }
        match setup.request {
            SET_MODEM_CTRL => {
                if setup.value & DTR_MEANT != 0 {
                    self.is_open = setup.value & DTR != 0;
                }
                Ok(ControlReply::DONE)
            }
            SET_LATENCY_TIMER => {
                let latency_ms = u8::try_from(setup.value).ok().filter(|latency_ms| *latency_ms > 0);
                self.latency_ms = latency_ms.ok_or(Refused)?;
                Ok(ControlReply::DONE)
            }
            RESET | SET_FLOW_CTRL | SET_BAUD_RATE | SET_DATA | SET_EVENT_CHAR | SET_ERROR_CHAR
            | SET_BITMODE => Ok(ControlReply::DONE),
            GET_MODEM_STATUS => Ok(ControlReply::Data(STATUS.to_vec())),
            GET_LATENCY_TIMER => Ok(ControlReply::Data(vec![self.latency_ms])),
            READ_EEPROM => Ok(ControlReply::Data(ERASED.to_vec())),
            _ => Err(Refused),
        }
    }

    fn packets(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let room = usize::from(Self::SPEED.bulk_packet_bytes()) - STATUS.len();
        // A full last packet does not end a transfer; the latency timer's packet does.
        bytes.chunks(room).map(|chunk| [&STATUS, chunk].concat()).collect()
    }

    fn is_open(&self) -> bool {
        self.is_open
    }

    fn idle_packet(&self) -> Option<(Duration, Vec<u8>)> {
        Some((Duration::from_millis(self.latency_ms.into()), STATUS.to_vec()))
    }
}

#[cfg(test)]
#[path = "ftdi_tests.rs"]
mod tests;
