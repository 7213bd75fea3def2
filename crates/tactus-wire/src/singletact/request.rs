//! What the host asks.

use super::decoder::Extent;
use super::{DEFAULT_ADDRESS, FOOTER, HEADER, READING_BYTES, READING_LOCATION};

/// Bytes before the data.
const HEAD_BYTES: usize = 10;
/// Bytes after the data: 0xFF and the footer.
const TAIL_BYTES: usize = 5;
/// How long the board is to wait for the element, in ms.
const BUS_TIMEOUT_MS: u8 = 100;

const READ: u8 = 1;
const WRITE: u8 = 2;
const CALIBRATE: u8 = 4;

/// Longest read.
const MAX_READ_BYTES: u8 = 32;
/// Longest write: what a transfer on the bus holds.
pub(super) const MAX_WRITE_BYTES: usize = 28;
/// Locations end here.
const LOCATIONS: u8 = 191;
/// Locations that can be written end here.
const WRITABLE: usize = 128;

/// A request, as the host writes and the device reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request<'a> {
    /// Of the element on the I2C bus, below 128; see [`DEFAULT_ADDRESS`].
    pub address: u8,
    /// Comes back with the reply.
    pub id: u8,
    /// What to do.
    pub operation: Operation<'a>,
}

/// What an element is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation<'a> {
    /// Answer with a part of the register.
    Read {
        /// Where it begins, 0 to 190.
        location: u8,
        /// How many bytes, up to 32.
        bytes: u8,
    },
    /// Write a part of the register; kept in flash, which takes some 50 ms.
    Write {
        /// Where it begins; it ends at 128 or before.
        location: u8,
        /// Up to 28 bytes.
        data: &'a [u8],
    },
    /// Write a part of the table of calibration; kept in flash.
    Calibrate {
        /// Which part of the table.
        location: u8,
        /// Up to 28 bytes.
        data: &'a [u8],
    },
}

/// Why a request cannot be asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum RequestError {
    /// No such address on an I2C bus.
    #[error("address {address} is not below 128")]
    Address { address: u8 },
    /// More bytes than a transfer holds, or none at all where some must be.
    #[error("{bytes} bytes do not fit: reads take up to 32, writes 1 to 28")]
    Length { bytes: usize },
    /// The register ends before, or may only be read there.
    #[error("location {location} and {bytes} bytes: reads end at 191, writes at 128")]
    Location { location: u8, bytes: usize },
}

impl Request<'static> {
    /// Asks the element at `address` for its reading.
    pub fn reading(address: u8, id: u8) -> Self {
        let operation = Operation::Read { location: READING_LOCATION, bytes: READING_BYTES };
        Self { address, id, operation }
    }
}

impl Default for Request<'static> {
    fn default() -> Self {
        Self::reading(DEFAULT_ADDRESS, 0)
    }
}

impl<'a> Request<'a> {
    /// The request as bytes.
    ///
    /// # Errors
    /// An address, a location or a number of bytes that the board or the element does not take.
    pub fn encode(&self) -> Result<Vec<u8>, RequestError> {
        let Self { address, id, operation } = *self;
        if address >= 0x80 {
            return Err(RequestError::Address { address });
        }
        let (code, location, bytes, data) = match operation {
            Operation::Read { location, bytes } => {
                if bytes > MAX_READ_BYTES {
                    return Err(RequestError::Length { bytes: bytes.into() });
                }
                if u16::from(location) + u16::from(bytes) > LOCATIONS.into() {
                    return Err(RequestError::Location { location, bytes: bytes.into() });
                }
                (READ, location, bytes, &[][..])
            }
            Operation::Write { location, data } => {
                if usize::from(location) + data.len() > WRITABLE {
                    return Err(RequestError::Location { location, bytes: data.len() });
                }
                (WRITE, location, writable(data)?, data)
            }
            Operation::Calibrate { location, data } => (CALIBRATE, location, writable(data)?, data),
        };
        let mut packet = Vec::with_capacity(HEAD_BYTES + data.len() + TAIL_BYTES + 1);
        packet.extend([HEADER; 4]);
        packet.extend([address, BUS_TIMEOUT_MS, id, code, location, bytes]);
        packet.extend(data);
        packet.push(0xFF);
        packet.extend(FOOTER);
        if code == READ {
            packet.push(0);
        }
        Ok(packet)
    }

    /// Reads a whole request, without the zero behind a read.
    pub(super) fn parse(packet: &'a [u8]) -> Option<Self> {
        let (head, rest) = packet.split_first_chunk::<HEAD_BYTES>()?;
        let data = rest.get(..rest.len().checked_sub(TAIL_BYTES)?)?;
        let &[_, _, _, _, address, _, id, code, location, bytes] = head;
        let operation = match code {
            READ => Operation::Read { location, bytes },
            WRITE => Operation::Write { location, data },
            CALIBRATE => Operation::Calibrate { location, data },
            _ => return None,
        };
        Some(Self { address, id, operation })
    }
}

/// What stands at the beginning of `bytes`.
pub(super) fn extent(bytes: &[u8]) -> Extent {
    let Some(&[a, b, c, d, address, _, _, code, _, n]) = bytes.first_chunk::<HEAD_BYTES>() else {
        return Extent::Unfinished;
    };
    let data_bytes = if code == READ { 0 } else { usize::from(n) };
    // A write of nothing is answered by no board.
    let known = code == READ || (matches!(code, WRITE | CALIBRATE) && n > 0);
    if [a, b, c, d] != [HEADER; 4] || address >= 0x80 || !known || data_bytes > MAX_WRITE_BYTES {
        return Extent::Impossible;
    }
    let length = HEAD_BYTES + data_bytes + TAIL_BYTES;
    match bytes.get(HEAD_BYTES + data_bytes..length) {
        None => Extent::Unfinished,
        Some([0xFF, footer @ ..]) if *footer == FOOTER => Extent::Whole { length },
        Some(_) => Extent::Impossible,
    }
}

fn writable(data: &[u8]) -> Result<u8, RequestError> {
    let length = RequestError::Length { bytes: data.len() };
    if data.is_empty() || data.len() > MAX_WRITE_BYTES {
        return Err(length);
    }
    u8::try_from(data.len()).map_err(|_| length)
}

#[cfg(test)]
#[path = "request_tests.rs"]
mod tests;
