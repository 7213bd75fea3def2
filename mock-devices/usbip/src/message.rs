//! USB/IP: requests of a kernel's virtual host controller for transfers, and the answers.
//!
//! Every message begins with 48 bytes. Numbers are big-endian, except in the setup data, which is as on the cable. Data
//! follows a submitted transfer to the device, and the answer to a transfer from it. Isochronous transfers have more;
//! no device here has such an endpoint.
//!
//! # Source
//! The Linux kernel's `Documentation/usb/usbip_protocol.rst`: `USBIP_CMD_SUBMIT`, `USBIP_RET_SUBMIT`,
//! `USBIP_CMD_UNLINK`, `USBIP_RET_UNLINK`.

use crate::setup::{SETUP_BYTES, Setup};

/// Length of the header of every message.
const HEADER_BYTES: usize = 48;

/// The longest accepted transfer, longer than any driver of these devices requests.
const TRANSFER_BYTES_MAX: usize = 1 << 20;

const CMD_SUBMIT: u32 = 1;
const CMD_UNLINK: u32 = 2;
const RET_SUBMIT: u32 = 3;
const RET_UNLINK: u32 = 4;

/// Number of isochronous packets in a transfer that is not isochronous.
const NO_PACKETS: u32 = u32::MAX;

/// A request of the host controller.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum UsbipRequest {
    /// Submits a transfer.
    Submit(Transfer),
    /// Cancels a transfer.
    Unlink {
        /// Number of this request.
        seq: u32,
        /// Number of the transfer.
        victim: u32,
    },
}

/// A transfer to or from an endpoint.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Transfer {
    /// Its number, which the answer repeats.
    pub(crate) seq: u32,
    /// Number of the endpoint, without its direction.
    pub(crate) endpoint: u8,
    pub(crate) flow: Direction,
    /// Only for the control endpoint.
    pub(crate) setup: Setup,
}

/// Direction of a transfer's data.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    /// To the host, which accepts this many bytes.
    In(usize),
    /// To the device.
    Out(Vec<u8>),
}

/// How a transfer ended, as the kernel's negative error numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TransferStatus {
    Done,
    /// The endpoint has halted, or refuses the request (`EPIPE`).
    Stalled,
    /// The device sent more than the host accepts (`EOVERFLOW`).
    Overflow,
    /// Cancelled before it ended (`ECONNRESET`).
    Unlinked,
}

impl TransferStatus {
    fn number(self) -> i32 {
        match self {
            Self::Done => 0,
            Self::Stalled => -32,
            Self::Overflow => -75,
            Self::Unlinked => -104,
        }
    }
}

/// The kernel sent no valid request. The connection cannot be used any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum MessageError {
    /// The kind of message is unknown.
    #[error("the host controller sent a message of kind {0}, which USB/IP requests are not")]
    Kind(u32),
    /// The transfer is too long.
    #[error("the host controller asks for a transfer of {0} bytes; {TRANSFER_BYTES_MAX} are the most")]
    Length(u32),
    /// The endpoint or direction does not exist in USB.
    #[error(
        "the host controller asks for endpoint {endpoint} in direction {direction}, which USB does not have"
    )]
    Endpoint {
        /// As found.
        endpoint: u32,
        /// As found.
        direction: u32,
    },
}

/// Splits the kernel's bytes into requests.
#[derive(Debug, Default)]
pub(crate) struct Decoder {
    bytes: Vec<u8>,
}

impl Decoder {
    /// Takes bytes from the kernel.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// The next complete request.
    ///
    /// # Errors
    /// If the bytes are no request. Every further call returns the same error.
    pub(crate) fn next_request(&mut self) -> Result<Option<UsbipRequest>, MessageError> {
        let Some((header, behind)) = self.bytes.split_first_chunk::<HEADER_BYTES>() else { return Ok(None) };
        let header = Header(header);
        let seq = header.word(4);
        match header.word(0) {
            CMD_UNLINK => {
                let victim = header.word(20);
                self.bytes.drain(..HEADER_BYTES);
                Ok(Some(UsbipRequest::Unlink { seq, victim }))
            }
            CMD_SUBMIT => {
                let length = header.length()?;
                let (endpoint, is_in) = header.endpoint()?;
                let setup = header.setup();
                let (flow, data_bytes) = if is_in {
                    (Direction::In(length), 0)
                } else {
                    let Some(data) = behind.get(..length) else { return Ok(None) };
                    (Direction::Out(data.to_vec()), length)
                };
                self.bytes.drain(..HEADER_BYTES + data_bytes);
                Ok(Some(UsbipRequest::Submit(Transfer { seq, endpoint, flow, setup })))
            }
            kind => Err(MessageError::Kind(kind)),
        }
    }
}

struct Header<'a>(&'a [u8; HEADER_BYTES]);

impl Header<'_> {
    fn word(&self, offset: usize) -> u32 {
        let word = self.0.get(offset..).and_then(|bytes| bytes.first_chunk());
        word.map_or(0, |word| u32::from_be_bytes(*word))
    }

    fn length(&self) -> Result<usize, MessageError> {
        let length = self.word(24);
        usize::try_from(length)
            .ok()
            .filter(|bytes| *bytes <= TRANSFER_BYTES_MAX)
            .ok_or(MessageError::Length(length))
    }

    fn endpoint(&self) -> Result<(u8, bool), MessageError> {
        let (direction, endpoint) = (self.word(12), self.word(16));
        match (u8::try_from(endpoint), direction) {
            (Ok(number @ 0..16), 0) => Ok((number, false)),
            (Ok(number @ 0..16), 1) => Ok((number, true)),
            _ => Err(MessageError::Endpoint { endpoint, direction }),
        }
    }

    fn setup(&self) -> Setup {
        let bytes = self.0.last_chunk::<SETUP_BYTES>();
        Setup::parse(bytes.copied().unwrap_or_default())
    }
}

/// Answers, as bytes for the kernel.
#[derive(Debug, Default)]
pub(crate) struct Answers {
    bytes: Vec<u8>,
}

impl Answers {
    /// A transfer to the host ended.
    pub(crate) fn sent(&mut self, seq: u32, status: TransferStatus, data: &[u8]) {
        self.answer(RET_SUBMIT, seq, status, data.len());
        self.bytes.extend_from_slice(data);
    }

    /// A transfer to the device ended; it took this many bytes.
    pub(crate) fn taken(&mut self, seq: u32, status: TransferStatus, bytes: usize) {
        self.answer(RET_SUBMIT, seq, status, bytes);
    }

    /// A request to cancel ended.
    pub(crate) fn unlinked(&mut self, seq: u32, status: TransferStatus) {
        self.answer(RET_UNLINK, seq, status, 0);
    }

    /// The bytes since the last call.
    pub(crate) fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }

    fn answer(&mut self, kind: u32, seq: u32, status: TransferStatus, bytes: usize) {
        // Transfers are much shorter than the field allows.
        let length = u32::try_from(bytes).unwrap_or(u32::MAX);
        let mut header = [0; HEADER_BYTES];
        let packets = if kind == RET_SUBMIT { NO_PACKETS } else { 0 };
        let words = [(0, kind.to_be_bytes()), (4, seq.to_be_bytes())];
        let ends =
            [(20, status.number().to_be_bytes()), (24, length.to_be_bytes()), (32, packets.to_be_bytes())];
        for (offset, word) in words.into_iter().chain(ends) {
            for (to, from) in header.iter_mut().skip(offset).zip(word) {
                *to = from;
            }
        }
        self.bytes.extend_from_slice(&header);
    }
}

#[cfg(test)]
#[path = "message_tests.rs"]
mod tests;
