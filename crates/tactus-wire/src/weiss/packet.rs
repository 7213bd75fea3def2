//! Packets, the envelope of all messages.

use super::crc;

/// Sync bytes at the beginning of every packet.
pub(super) const SYNC: [u8; 3] = [0xAA; 3];

/// Bytes before the payload: sync, id, length.
pub(super) const HEADER_BYTES: usize = 6;

/// Longest payload, by the size of the length field.
pub const MAX_PAYLOAD_BYTES: usize = u16::MAX as usize;

/// Packet ids; a reply carries the id of its command.
pub mod id {
    /// Full frame.
    pub const FRAME: u8 = 0x00;
    /// Controller configuration.
    pub const CONTROLLER: u8 = 0x01;
    /// Sensor configuration.
    pub const SENSOR: u8 = 0x02;
    /// Configure the data acquisition.
    pub const ACQUIRE: u8 = 0x03;
    /// Matrix configuration.
    pub const MATRIX: u8 = 0x0B;
}

/// A packet with a correct checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Packet<'a> {
    /// Its kind; see [`id`].
    pub id: u8,
    /// Its content.
    pub payload: &'a [u8],
}

/// Encodes a packet. An empty payload has no checksum.
///
/// No packet may have the id 0xAA: a decoder would take it for a sync byte.
///
/// # Panics
/// If the payload is longer than [`MAX_PAYLOAD_BYTES`].
pub fn encode_packet(id: u8, payload: &[u8]) -> Vec<u8> {
    assert!(payload.len() <= MAX_PAYLOAD_BYTES, "a payload of {} bytes has no length field", payload.len());
    #[expect(clippy::cast_possible_truncation, reason = "asserted above")]
    let [length_low, length_high] = (payload.len() as u16).to_le_bytes();
    let head = [id, length_low, length_high];
    let mut bytes = Vec::with_capacity(HEADER_BYTES + payload.len() + 2);
    bytes.extend(SYNC);
    bytes.extend(head);
    bytes.extend(payload);
    if !payload.is_empty() {
        bytes.extend(crc::update(crc(&head), payload).to_le_bytes());
    }
    bytes
}

#[cfg(test)]
#[path = "packet_tests.rs"]
mod tests;
