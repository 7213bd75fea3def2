//! The frame packet: one reading of all elements.

use super::{Packet, encode_packet, id};

/// Bit of the flags byte: counts are run-length encoded.
const RUN_LENGTH: u8 = 0x01;

/// Greatest count in a run-length word.
const MAX_RUN_COUNTS: u16 = 0x0FFF;

/// At least the greatest number of counts in a run, which is 15.
const RUN_ROOM: usize = 16;

/// One reading of all elements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecodedFrame {
    /// The controller's clock in ms. It starts again at 0 after 49.7 days.
    pub timestamp_ms: u32,
    /// True if the counts were run-length encoded.
    pub run_length: bool,
    /// Raw counts, row-major, as on the wire.
    pub counts: Vec<u16>,
}

/// Why a packet is not the expected frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum FrameError {
    /// The packet has another id.
    #[error("packet {id:#04x} is not a frame")]
    NotAFrame { id: u8 },
    /// The payload ends before the counts, or within one.
    #[error("a frame of {bytes} bytes has no whole number of counts")]
    Length { bytes: usize },
    /// The array has another number of elements than expected.
    #[error("the frame has {found} elements, the rig's array has {expected}")]
    Elements { expected: usize, found: usize },
}

impl DecodedFrame {
    /// Decodes a frame of exactly `elements` counts.
    ///
    /// # Errors
    /// If it is another packet, is damaged, or has another number of elements.
    #[inline]
    pub fn parse(packet: &Packet<'_>, elements: usize) -> Result<Self, FrameError> {
        let frame = PackedFrame::parse(packet, elements)?;
        let counts = if frame.run_length { frame.unpack(elements) } else { frame.words().collect() };
        Ok(Self { timestamp_ms: frame.timestamp_ms, run_length: frame.run_length, counts })
    }
}

/// A frame that was checked, with its counts as they are in the packet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PackedFrame<'a> {
    /// See [`DecodedFrame`].
    pub(crate) timestamp_ms: u32,
    run_length: bool,
    texels: &'a [[u8; 2]],
}

impl<'a> PackedFrame<'a> {
    /// Checks a frame of exactly `elements` counts.
    ///
    /// # Errors
    /// As [`DecodedFrame::parse`].
    pub(crate) fn parse(packet: &Packet<'a>, elements: usize) -> Result<Self, FrameError> {
        if packet.id != id::FRAME {
            return Err(FrameError::NotAFrame { id: packet.id });
        }
        let length = FrameError::Length { bytes: packet.payload.len() };
        let (timestamp, rest) = packet.payload.split_first_chunk::<4>().ok_or(length)?;
        let (flags, texels) = rest.split_first().ok_or(length)?;
        let (texels, []) = texels.as_chunks::<2>() else { return Err(length) };
        let run_length = flags & RUN_LENGTH != 0;
        let frame = Self { timestamp_ms: u32::from_le_bytes(*timestamp), run_length, texels };
        let found = if run_length { frame.words().map(repeats).sum::<u32>() as usize } else { texels.len() };
        if found == elements { Ok(frame) } else { Err(FrameError::Elements { expected: elements, found }) }
    }

    /// Writes the counts into `counts`, of which there is one for each element.
    pub(crate) fn write_to(self, counts: &mut [f32]) {
        if !self.run_length {
            for (count, word) in counts.iter_mut().zip(self.words()) {
                *count = word.into();
            }
            return;
        }
        let mut rest = counts;
        for word in self.words() {
            let Some((run, later)) = rest.split_at_mut_checked(repeats(word) as usize) else { return };
            run.fill((word & MAX_RUN_COUNTS).into());
            rest = later;
        }
    }

    /// The counts of a run-length frame.
    fn unpack(self, elements: usize) -> Vec<u16> {
        // Not zeros, which cost more memory management than their length.
        let mut counts = vec![MAX_RUN_COUNTS; elements + RUN_ROOM];
        let mut at = 0;
        for word in self.words() {
            // More than the run has, because a fixed number costs less than the right one.
            let Some(room) = counts.get_mut(at..).and_then(<[u16]>::first_chunk_mut) else { break };
            *room = [word & MAX_RUN_COUNTS; RUN_ROOM];
            at += repeats(word) as usize;
        }
        counts.truncate(elements);
        counts
    }

    fn words(self) -> impl Iterator<Item = u16> + 'a {
        self.texels.iter().map(|word| u16::from_le_bytes(*word))
    }
}

fn repeats(word: u16) -> u32 {
    u32::from(word >> 12)
}

/// Encodes a frame as a packet.
///
/// Run-length words have twelve bits, so counts above 4095 become 4095.
///
/// # Panics
/// If the counts do not fit into one packet: more than 32 765 of them.
pub fn encode_frame(timestamp_ms: u32, counts: &[u16], run_length: bool) -> Vec<u8> {
    let mut payload = Vec::with_capacity(5 + 2 * counts.len());
    payload.extend(timestamp_ms.to_le_bytes());
    payload.push(if run_length { RUN_LENGTH } else { 0 });
    if run_length {
        let clamped: Vec<u16> = counts.iter().map(|count| (*count).min(MAX_RUN_COUNTS)).collect();
        for run in clamped.chunk_by(|a, b| a == b).flat_map(|run| run.chunks(15)) {
            let count = run.first().copied().unwrap_or(0);
            #[expect(clippy::cast_possible_truncation, reason = "at most 15")]
            let repeats = run.len() as u16;
            payload.extend((repeats << 12 | count).to_le_bytes());
        }
    } else {
        payload.extend(counts.iter().flat_map(|count| count.to_le_bytes()));
    }
    encode_packet(id::FRAME, &payload)
}

#[cfg(test)]
#[path = "frame_tests.rs"]
mod tests;
