//! Frames out of a stream of bytes that marks only their ends, and not only these.

use super::{DecodedFrame, FRAME_BYTES};

/// So many frames in a row must end where they should before the first is believed.
pub const CONFIRMING_FRAMES: usize = 3;

/// Finds frames in a stream that may be cut anywhere and hold garbage.
///
/// Feed it with [`push`](Self::push), then call [`next_frame`](Self::next_frame) until it gives
/// `None`; what comes out does not depend on how the stream was cut. It holds at most [`CONFIRMING_FRAMES`]
/// frames and what was pushed since.
///
/// A frame that follows another is given when its last byte arrives. At the beginning, and where a frame does
/// not end as it should, the decoder looks for the first place from where [`CONFIRMING_FRAMES`] frames do:
/// those before the last of them are late, but none is lost.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    bytes: Vec<u8>,
    /// Bytes before this are done with.
    start: usize,
    /// A frame begins at `start`.
    in_step: bool,
    stats: DecoderStats,
}

/// What a [`Decoder`] met beside good frames, since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DecoderStats {
    /// Bytes that were part of no frame.
    pub skipped_bytes: u64,
    /// How often it fell out of step: at least one frame was lost or damaged each time.
    pub lost_steps: u64,
}

impl Decoder {
    /// An empty decoder.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes what arrived.
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

    /// What it met beside good frames.
    pub fn stats(&self) -> DecoderStats {
        self.stats
    }

    /// Whether plausible frames follow each other from `at`; `None` if not enough has arrived to know.
    fn goes_on_from(&self, at: usize) -> Option<bool> {
        for count in 0..CONFIRMING_FRAMES {
            let frame = DecodedFrame::parse(self.whole_at(at + count * FRAME_BYTES)?);
            if !frame.is_some_and(|frame| frame.is_plausible()) {
                return Some(false);
            }
        }
        Some(true)
    }

    /// The bytes of a frame that begins at `at`, if they have all arrived.
    fn whole_at(&self, at: usize) -> Option<&[u8; FRAME_BYTES]> {
        self.bytes.get(at..)?.first_chunk()
    }
}

#[cfg(test)]
#[path = "decoder_tests.rs"]
mod tests;
