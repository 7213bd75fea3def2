//! Replies of the interface board.

use super::decoder::Extent;
use super::{FOOTER, HEADER, READING_BYTES, USB_HEADER};

/// Length of the header, before the data.
const HEAD_BYTES: usize = 12;

/// Most data in a reply: what a read can request.
const MAX_DATA_BYTES: usize = 32;

/// The answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reply<'a> {
    /// Which board sent it.
    pub via: Via,
    /// Address of the element on the I2C bus.
    pub address: u8,
    /// True if the element did not answer the board. The data then have no meaning.
    pub timed_out: bool,
    /// Id of the request.
    pub id: u8,
    /// The board's clock in units of 0.1 ms. It starts again at 0 after 119 h.
    pub timestamp_ticks: u32,
    /// The requested bytes; empty in the answer to a write.
    pub data: &'a [u8],
}

/// Which board is between the host and the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Via {
    /// An Arduino with the published sketch.
    Arduino,
    /// The USB board.
    Usb,
}

/// The data at [`READING_LOCATION`](super::READING_LOCATION).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ElementReading {
    /// Number of the element's reading; starts again at 0 after 65 535.
    pub counter: u16,
    /// The value in counts; see [`BASELINE_COUNTS`](super::BASELINE_COUNTS).
    pub counts: u16,
}

/// Why a reply is not the requested reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ReplyError {
    /// The element did not answer the board.
    #[error(
        "the element at address {address} did not answer on the I2C bus; check its address and its cable"
    )]
    TimedOut { address: u8 },
    /// It has another number of bytes.
    #[error("a reading has 6 bytes, not {bytes}")]
    Length { bytes: usize },
}

impl<'a> Reply<'a> {
    /// The reply as bytes.
    ///
    /// # Panics
    /// If there are more than 32 bytes of data.
    pub fn encode(&self) -> Vec<u8> {
        assert!(self.data.len() <= MAX_DATA_BYTES, "a reply of {} bytes", self.data.len());
        #[expect(clippy::cast_possible_truncation, reason = "asserted above")]
        let bytes = self.data.len() as u8;
        let mut packet = Vec::with_capacity(HEAD_BYTES + self.data.len() + FOOTER.len());
        packet.extend([self.via.header(); 4]);
        packet.extend([self.address, u8::from(self.timed_out), self.id]);
        packet.extend(self.timestamp_ticks.to_be_bytes());
        packet.push(bytes);
        packet.extend(self.data);
        packet.extend(FOOTER);
        packet
    }

    /// Decodes the data as a reading.
    ///
    /// # Errors
    /// If the element did not answer, or the reply has other data.
    pub fn reading(&self) -> Result<ElementReading, ReplyError> {
        if self.timed_out {
            return Err(ReplyError::TimedOut { address: self.address });
        }
        let &[counter_high, counter_low, _, _, high, low] = self.data else {
            return Err(ReplyError::Length { bytes: self.data.len() });
        };
        let counter = u16::from_be_bytes([counter_high, counter_low]);
        Ok(ElementReading { counter, counts: u16::from_be_bytes([high, low]) })
    }

    /// Parses a complete reply.
    pub(super) fn parse(packet: &'a [u8]) -> Option<Self> {
        let (head, rest) = packet.split_first_chunk::<HEAD_BYTES>()?;
        let data = rest.get(..rest.len().checked_sub(FOOTER.len())?)?;
        let &[header, _, _, _, address, timed_out, id, t3, t2, t1, t0, _] = head;
        Some(Self {
            via: if header == USB_HEADER { Via::Usb } else { Via::Arduino },
            address,
            timed_out: timed_out != 0,
            id,
            timestamp_ticks: u32::from_be_bytes([t3, t2, t1, t0]),
            data,
        })
    }
}

impl ElementReading {
    /// The data of a reply with this reading. The two ignored bytes are zero.
    pub fn encode(self) -> [u8; READING_BYTES as usize] {
        let ([counter_high, counter_low], [high, low]) =
            (self.counter.to_be_bytes(), self.counts.to_be_bytes());
        [counter_high, counter_low, 0, 0, high, low]
    }
}

impl Via {
    fn header(self) -> u8 {
        match self {
            Self::Arduino => HEADER,
            Self::Usb => USB_HEADER,
        }
    }
}

/// What begins at the beginning of `bytes`.
pub(super) fn extent(bytes: &[u8]) -> Extent {
    let Some(&[a, b, c, d, address, _, _, _, _, _, _, n]) = bytes.first_chunk::<HEAD_BYTES>() else {
        return Extent::Unfinished;
    };
    let header = [a, b, c, d];
    let known = header == [HEADER; 4] || header == [USB_HEADER; 4];
    if !known || address >= 0x80 || usize::from(n) > MAX_DATA_BYTES {
        return Extent::Impossible;
    }
    let footer_at = HEAD_BYTES + usize::from(n);
    match bytes.get(footer_at..footer_at + FOOTER.len()) {
        None => Extent::Unfinished,
        Some(footer) if footer == FOOTER => Extent::Whole { length: footer_at + FOOTER.len() },
        Some(_) => Extent::Impossible,
    }
}

#[cfg(test)]
#[path = "reply_tests.rs"]
mod tests;
