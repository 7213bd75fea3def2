//! The two forms of a packet's checksum.

use super::crc;
use super::packet::{HEADER_BYTES, SYNC};

/// Checksum of packets with a payload; it depends on the controller's firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Checksum {
    /// [`crc()`]: two bytes, low byte first.
    #[default]
    Crc,
    /// Older firmware: the low eight bits of the sum of the same bytes. One damaged packet in 256 is not detected.
    Sum8,
}

impl Checksum {
    /// A packet from an encoder of [this module](super), with the checksum in this form.
    pub fn close(self, mut packet: Vec<u8>) -> Vec<u8> {
        if self == Self::Sum8 && packet.len() > HEADER_BYTES {
            packet.truncate(packet.len().saturating_sub(Self::Crc.bytes()));
            let covered = packet.get(SYNC.len()..).unwrap_or_default();
            packet.push(sum8(covered));
        }
        packet
    }

    /// Its length in bytes.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Crc => 2,
            Self::Sum8 => 1,
        }
    }

    /// The checksum of id, length and payload.
    pub(super) fn of(self, covered: &[u8]) -> u16 {
        match self {
            Self::Crc => crc(covered),
            Self::Sum8 => sum8(covered).into(),
        }
    }

    /// The checksum at the beginning of `bytes`, if all of it has arrived.
    pub(super) fn read(self, bytes: &[u8]) -> Option<u16> {
        match self {
            Self::Crc => bytes.first_chunk().map(|bytes| u16::from_le_bytes(*bytes)),
            Self::Sum8 => bytes.first().map(|byte| u16::from(*byte)),
        }
    }
}

fn sum8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

#[cfg(test)]
#[path = "checksum_tests.rs"]
mod tests;
