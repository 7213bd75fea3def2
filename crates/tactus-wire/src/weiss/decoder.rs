//! Finds packets in a stream of bytes that may contain garbage.

use std::ops::Range;

use super::packet::{HEADER_BYTES, SYNC, id};
use super::{BOOT_MESSAGE, Checksum, Packet};

/// Longest payload that [`Decoder::new`] accepts.
const DEFAULT_MAX_PAYLOAD_BYTES: usize = 4096;

/// Finds packets in a stream that may contain garbage.
///
/// Call [`push`](Self::push) with each read, then [`next_packet`](Self::next_packet) until it returns `None`. The result
/// does not depend on how the bytes arrive. At most one incomplete packet and the last read are kept.
///
/// Sync bytes may occur within a payload or in garbage. Of overlapping candidates, the packet that ends first and has a
/// correct checksum is accepted. So a damaged length never hides the frames behind it, and the first complete packet after
/// garbage is found when its last byte arrives.
#[derive(Debug, Clone)]
pub struct Decoder {
    bytes: Vec<u8>,
    /// Bytes before this index have been used.
    start: usize,
    max_payload_bytes: usize,
    checksum: Checksum,
    /// Length of the beginning of [`BOOT_MESSAGE`] with which the skipped bytes end.
    boot_matched: usize,
    stats: DecoderStats,
}

/// What a [`Decoder`] has received besides good packets, since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DecoderStats {
    /// Bytes that belonged to no packet.
    pub skipped_bytes: u64,
    /// Packets with a wrong checksum, and frames that have none.
    pub bad_checksums: u64,
    /// Boot messages among the skipped bytes.
    pub boot_messages: u64,
}

/// A packet's checksum is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("packet {id:#04x} of {bytes} bytes has the checksum {found:#06x}, not {expected:#06x}")]
pub struct ChecksumError {
    /// The packet's id, unless that is damaged.
    pub id: u8,
    /// Length of its payload, unless that is damaged.
    pub bytes: usize,
    /// Checksum computed from the packet.
    pub expected: u16,
    /// Checksum in the packet.
    pub found: u16,
}

/// What begins at sync bytes.
enum PacketCandidate {
    /// No packet: the id or the length is impossible.
    Impossible,
    /// A frame without a payload, and so without a checksum: no frame, but a damaged one.
    EmptyFrame,
    /// A possible packet that has not arrived completely.
    Unfinished,
    /// A complete packet.
    Whole { end: usize, verdict: Result<(), ChecksumError> },
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A decoder for payloads of up to 4096 bytes.
    pub fn new() -> Self {
        Self::with_max_payload(DEFAULT_MAX_PAYLOAD_BYTES)
    }

    /// A decoder for payloads of up to `bytes`; longer ones count as garbage.
    pub fn with_max_payload(bytes: usize) -> Self {
        Self {
            bytes: Vec::new(),
            start: 0,
            max_payload_bytes: bytes,
            checksum: Checksum::default(),
            boot_matched: 0,
            stats: DecoderStats::default(),
        }
    }

    /// The same decoder with another form of checksum.
    #[must_use]
    pub fn with_checksum(self, checksum: Checksum) -> Self {
        Self { checksum, ..self }
    }

    /// Takes the bytes of a read.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.start);
        self.start = 0;
        self.bytes.extend_from_slice(bytes);
    }

    /// The next packet, the error of a wrong checksum, or `None` until more is pushed.
    pub fn next_packet(&mut self) -> Option<Result<Packet<'_>, ChecksumError>> {
        loop {
            self.skip_to_sync();
            let outer_at = self.start;
            let (limit, verdict) = match self.inspect(outer_at) {
                PacketCandidate::Impossible => {
                    self.skip(1);
                    continue;
                }
                PacketCandidate::EmptyFrame => {
                    self.stats.bad_checksums += 1;
                    self.skip(1);
                    continue;
                }
                PacketCandidate::Unfinished => (self.bytes.len() + 1, None),
                PacketCandidate::Whole { end, verdict } => (end, Some(verdict)),
            };
            // The id behind the sync bytes is no sync byte, so that no other packet begins before it.
            if let Some(inner) = self.first_to_end_within(outer_at + SYNC.len() + 1, limit) {
                self.skip(inner.start - outer_at);
                return self.accept(inner.end).map(Ok);
            }
            return match verdict? {
                Ok(()) => self.accept(limit).map(Ok),
                Err(error) => {
                    self.stats.bad_checksums += 1;
                    self.skip(1);
                    Some(Err(error))
                }
            };
        }
    }

    /// What it has received besides good packets.
    pub fn stats(&self) -> DecoderStats {
        self.stats
    }

    /// Skips to the next sync bytes; without any, to the end except for what may become sync bytes.
    fn skip_to_sync(&mut self) {
        let rest = self.bytes.get(self.start..).unwrap_or_default();
        if rest.starts_with(&SYNC) {
            return;
        }
        let skipped = find_sync(rest).unwrap_or_else(|| {
            let begun = rest.iter().rev().take(SYNC.len() - 1).take_while(|byte| **byte == SYNC[0]).count();
            rest.len() - begun
        });
        self.skip(skipped);
    }

    fn inspect(&self, at: usize) -> PacketCandidate {
        let Some(rest) = self.bytes.get(at + SYNC.len()..) else { return PacketCandidate::Unfinished };
        let Some(&[kind, length_low, length_high]) = rest.first_chunk() else {
            // The header begins behind the last sync byte, because no id equals one.
            return if rest.first() == Some(&SYNC[0]) {
                PacketCandidate::Impossible
            } else {
                PacketCandidate::Unfinished
            };
        };
        let length = usize::from(u16::from_le_bytes([length_low, length_high]));
        if kind == SYNC[0] || length > self.max_payload_bytes {
            return PacketCandidate::Impossible;
        }
        if length == 0 && kind == id::FRAME {
            return PacketCandidate::EmptyFrame;
        }
        if length == 0 {
            return PacketCandidate::Whole { end: at + HEADER_BYTES, verdict: Ok(()) };
        }
        let covered = HEADER_BYTES - SYNC.len() + length;
        let Some((covered, tail)) = rest.split_at_checked(covered) else {
            return PacketCandidate::Unfinished;
        };
        let Some(found) = self.checksum.read(tail) else { return PacketCandidate::Unfinished };
        let expected = self.checksum.of(covered);
        let verdict = if expected == found {
            Ok(())
        } else {
            Err(ChecksumError { id: kind, bytes: length, expected, found })
        };
        PacketCandidate::Whole { end: at + HEADER_BYTES + length + self.checksum.bytes(), verdict }
    }

    /// Of the packets with a correct checksum that begin at `from` or later and end before `limit`, the one that ends first.
    fn first_to_end_within(&self, mut from: usize, mut limit: usize) -> Option<Range<usize>> {
        let mut first = None;
        while let Some(offset) = find_sync(self.bytes.get(from..limit.min(self.bytes.len()))?) {
            let at = from + offset;
            if let PacketCandidate::Whole { end, verdict: Ok(()) } = self.inspect(at)
                && end < limit
                && end > at + HEADER_BYTES
            {
                first = Some(at..end);
                limit = end;
            }
            from = at + 1;
        }
        first
    }

    /// Takes the packet from `start` to `end`.
    fn accept(&mut self, end: usize) -> Option<Packet<'_>> {
        let packet = self.bytes.get(self.start..end)?;
        let id = *packet.get(SYNC.len())?;
        let payload =
            packet.get(HEADER_BYTES..packet.len().saturating_sub(self.checksum.bytes())).unwrap_or_default();
        self.start = end;
        self.boot_matched = 0;
        Some(Packet { id, payload })
    }

    fn skip(&mut self, count: usize) {
        let skipped = self.bytes.get(self.start..self.start + count).unwrap_or_default();
        for byte in skipped {
            // ESC occurs only at the beginning of the message, so a mismatch falls back to the beginning.
            let expected = BOOT_MESSAGE.get(self.boot_matched);
            self.boot_matched = match expected {
                Some(expected) if expected == byte => self.boot_matched + 1,
                _ => usize::from(*byte == BOOT_MESSAGE[0]),
            };
            if self.boot_matched == BOOT_MESSAGE.len() {
                self.stats.boot_messages += 1;
                self.boot_matched = 0;
            }
        }
        self.stats.skipped_bytes += skipped.len() as u64;
        self.start += skipped.len();
    }
}

/// Offset of the first three sync bytes in a row.
fn find_sync(bytes: &[u8]) -> Option<usize> {
    let mut at = 0;
    loop {
        at += find_sync_byte(bytes.get(at..)?)?;
        at += match bytes.get(at..)?.first_chunk()? {
            &SYNC => return Some(at),
            [_, _, 0xAA] => 2,
            [_, _, _] => 3,
        };
    }
}

/// Offset of the first sync byte. It compares blocks, which the compiler vectorises.
fn find_sync_byte(bytes: &[u8]) -> Option<usize> {
    let (blocks, rest) = bytes.as_chunks::<32>();
    let has_none =
        |block: &&[u8; 32]| block.iter().fold(0, |any, byte| any | u8::from(*byte == SYNC[0])) == 0;
    let without = 32 * blocks.iter().take_while(has_none).count();
    // The rest is the end of a block that overlaps the one before.
    if without + rest.len() == bytes.len() && bytes.last_chunk().as_ref().is_some_and(has_none) {
        return None;
    }
    let rest = bytes.get(without..)?;
    rest.iter().position(|byte| *byte == SYNC[0]).map(|offset| without + offset)
}

#[cfg(test)]
#[path = "decoder_tests.rs"]
mod tests;
