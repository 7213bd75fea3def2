//! Finds frames in a stream whose only marks are the frames' ends, which can also occur within frames.

use super::{DecodedFrame, FRAME_BYTES};

/// Number of frames in a row that must have the right end before the first is accepted.
pub const CONFIRMING_FRAMES: usize = 3;

/// Finds frames in a stream that may contain garbage.
///
/// Call [`push`](Self::push) with each read, then [`next_frame`](Self::next_frame) until it returns `None`. The result does
/// not depend on how the bytes arrive. At most [`CONFIRMING_FRAMES`] frames and the last read are kept.
///
/// A frame that follows another is returned when its last byte arrives. At the beginning, and after a frame with a wrong
/// end, the decoder searches for the first place at which [`CONFIRMING_FRAMES`] frames begin. All but the last of these are
/// returned late, but none is lost.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    bytes: Vec<u8>,
    /// Bytes before this index have been used.
    start: usize,
    /// True if a frame begins at `start`.
    in_step: bool,
    stats: DecoderStats,
}

/// What a [`Decoder`] has received besides good frames, since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DecoderStats {
    /// Bytes that belonged to no frame.
    pub skipped_bytes: u64,
    /// How often synchronisation was lost; each time at least one frame was lost or damaged.
    pub lost_steps: u64,
}

impl Decoder {
    /// An empty decoder.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the bytes of a read.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.start);
        self.start = 0;
        self.bytes.extend_from_slice(bytes);
    }

    /// The next frame, or `None` until more is pushed.
    pub fn next_frame(&mut self) -> Option<DecodedFrame> {
        if self.in_step {
            if let Some(frame) = DecodedFrame::parse(self.whole_at(self.start)?) {
                self.start += FRAME_BYTES;
                return Some(frame);
            }
            self.in_step = false;
            self.stats.lost_steps += 1;
        }
        while !self.goes_on_from(self.start)? {
            self.start += 1;
            self.stats.skipped_bytes += 1;
        }
        self.in_step = true;
        let frame = DecodedFrame::parse(self.whole_at(self.start)?)?;
        self.start += FRAME_BYTES;
        Some(frame)
    }

    /// What it has received besides good frames.
    pub fn stats(&self) -> DecoderStats {
        self.stats
    }

    /// Whether plausible frames follow each other from `at`; `None` if not enough bytes have arrived.
    fn goes_on_from(&self, at: usize) -> Option<bool> {
        for count in 0..CONFIRMING_FRAMES {
            let frame = DecodedFrame::parse(self.whole_at(at + count * FRAME_BYTES)?);
            if !frame.is_some_and(|frame| frame.is_plausible()) {
                return Some(false);
            }
        }
        Some(true)
    }

    /// The bytes of a frame that begins at `at`, if all have arrived.
    fn whole_at(&self, at: usize) -> Option<&[u8; FRAME_BYTES]> {
        self.bytes.get(at..)?.first_chunk()
    }
}

#[cfg(test)]
#[path = "decoder_tests.rs"]
mod tests;
