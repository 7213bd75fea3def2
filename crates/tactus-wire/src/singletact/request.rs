//! Requests of the host.

use super::decoder::Extent;
use super::{DEFAULT_ADDRESS, FOOTER, HEADER, READING_BYTES, READING_LOCATION};

/// Length of the header, before the data.
const HEAD_BYTES: usize = 10;
/// Length after the data: 0xFF and the footer.
const TAIL_BYTES: usize = 5;
/// How long the board waits for the element, in ms.
const BUS_TIMEOUT_MS: u8 = 100;

const READ: u8 = 1;
const WRITE: u8 = 2;
const CALIBRATE: u8 = 4;

/// Longest read.
const MAX_READ_BYTES: u8 = 32;
/// Longest write, limited by a transfer on the bus.
pub(super) const MAX_WRITE_BYTES: usize = 28;
/// End of the register.
const LOCATIONS: u8 = 191;
/// End of the writable part of the register.
const WRITABLE: usize = 128;

/// A request of the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request<'a> {
    /// Address of the element on the I2C bus, below 128; see [`DEFAULT_ADDRESS`].
    pub address: u8,
    /// The reply repeats it.
    pub id: u8,
    /// What the element is to do.
    pub operation: Operation<'a>,
}

/// An operation of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation<'a> {
    /// Read a part of the register.
    Read {
        /// First location, 0 to 190.
        location: u8,
        /// Number of bytes, up to 32.
        bytes: u8,
    },
    /// Write a part of the register. It is kept in flash, which takes about 50 ms.
    Write {
        /// First location. The data must end by location 128.
        location: u8,
        /// Up to 28 bytes.
        data: &'a [u8],
    },
    /// Write a part of the calibration table. It is kept in flash.
    Calibrate {
        /// First location in the table.
        location: u8,
        /// Up to 28 bytes.
        data: &'a [u8],
    },
}

/// Why a request is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum RequestError {
    /// The I2C bus has no such address.
    #[error("address {address} is not below 128")]
    Address { address: u8 },
    /// More bytes than fit in a transfer, or an empty write.
    #[error("{bytes} bytes do not fit: reads take up to 32, writes 1 to 28")]
    Length { bytes: usize },
    /// The register ends before the data, or is read-only there.
    #[error("location {location} and {bytes} bytes: reads end at 191, writes at 128")]
    Location { location: u8, bytes: usize },
}

impl Request<'static> {
    /// The request for the reading of the element at `address`.
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
    /// If an address, location or number of bytes is outside the range of the board or the element.
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

    /// Parses a complete request, without the zero behind a read.
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

/// What begins at the beginning of `bytes`.
pub(super) fn extent(bytes: &[u8]) -> Extent {
    let Some(&[a, b, c, d, address, _, _, code, _, n]) = bytes.first_chunk::<HEAD_BYTES>() else {
        return Extent::Unfinished;
    };
    let data_bytes = if code == READ { 0 } else { usize::from(n) };
    // No board answers an empty write.
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
