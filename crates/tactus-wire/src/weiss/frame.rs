//! The frame packet: one reading of all elements.

use super::{Packet, encode_packet, id};

/// Bit of the flags byte: counts are run-length encoded.
const RUN_LENGTH: u8 = 0x01;

/// Greatest count in a run-length word.
const MAX_RUN_COUNTS: u16 = 0x0FFF;

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
    pub fn parse(packet: &Packet<'_>, elements: usize) -> Result<Self, FrameError> {
        let frame = PackedFrame::parse(packet, elements)?;
        let counts = if frame.run_length { frame.runs().collect() } else { frame.words().collect() };
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
        let found = if run_length { frame.words().map(repeats).sum() } else { texels.len() };
        if found == elements { Ok(frame) } else { Err(FrameError::Elements { expected: elements, found }) }
    }

    /// Writes the counts into `counts`, of which there is one for each element.
    pub(crate) fn write_to(self, counts: &mut [f32]) {
        if self.run_length {
            write(self.runs(), counts);
        } else {
            write(self.words(), counts);
        }
    }

    fn words(self) -> impl Iterator<Item = u16> + 'a {
        self.texels.iter().map(|word| u16::from_le_bytes(*word))
    }

    fn runs(self) -> impl Iterator<Item = u16> + 'a {
        self.words().flat_map(|word| std::iter::repeat_n(word & MAX_RUN_COUNTS, repeats(word)))
    }
}

fn repeats(word: u16) -> usize {
    usize::from(word >> 12)
}

fn write(from: impl Iterator<Item = u16>, counts: &mut [f32]) {
    for (count, read) in counts.iter_mut().zip(from) {
        *count = f32::from(read);
    }
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
