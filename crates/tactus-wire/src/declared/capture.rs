//! Compares a recording with a description.

mod hint;
mod search;

use std::collections::BTreeMap;
use std::sync::Arc;

pub use hint::Hint;

use super::inspect::FrameCandidate;
use super::sniff::find;
use super::{Decoder, DecoderStats, Format, Framing};

/// Strides that are reported.
const STRIDES_TOLD: usize = 5;
/// Each sync is compared with this many syncs behind it.
const SYNCS_BEHIND: usize = 8;

/// Result of [`check_capture`].
#[derive(Debug, Clone, PartialEq)]
pub struct CaptureReport {
    /// Length of the capture in bytes.
    pub bytes: usize,
    /// Statistics of the decoder.
    pub stats: DecoderStats,
    /// Offset of the first frame.
    pub first_frame_at: Option<usize>,
    /// Offset of the first byte that belongs to no frame.
    pub first_skipped_at: Option<usize>,
    /// Number of occurrences of the sync bytes, including those within frames.
    pub syncs: usize,
    /// Distances from each sync to the next eight, most frequent first; at most five.
    pub strides: Vec<Stride>,
    /// The first frame with a wrong length field.
    pub first_bad_length: Option<Mismatch>,
    /// Offset of the first frame with a wrong trailer.
    pub first_bad_trailer_at: Option<usize>,
    /// The first frame with a wrong checksum.
    pub first_bad_checksum: Option<Mismatch>,
    /// Possible corrections of the description, most likely first.
    pub hints: Vec<Hint>,
}

/// A distance between sync bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stride {
    /// The distance in bytes.
    pub bytes: usize,
    /// Number of occurrences.
    pub count: usize,
}

/// A number that differs from the expected one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mismatch {
    /// Offset of the frame.
    pub at: usize,
    /// The expected number.
    pub expected: u64,
    /// The number in the frame.
    pub found: u64,
}

/// Compares a capture with a description: which frames decode, where decoding fails first, and how to correct the
/// description.
///
/// A capture of packets is their bytes in sequence.
pub fn check_capture(format: &Arc<Format>, capture: &[u8]) -> CaptureReport {
    let (frames_at, stats) = decode(format, capture);
    let heads: Vec<usize> =
        if format.head.is_empty() { Vec::new() } else { find(capture, &format.head).collect() };
    let strides = strides(&heads);
    let mut report = CaptureReport {
        bytes: capture.len(),
        stats,
        first_frame_at: frames_at.first().copied(),
        first_skipped_at: first_skipped(&frames_at, format.bytes, capture.len()),
        syncs: heads.len(),
        strides: strides.iter().take(STRIDES_TOLD).copied().collect(),
        first_bad_length: None,
        first_bad_trailer_at: None,
        first_bad_checksum: None,
        hints: Vec::new(),
    };
    report.find_first_faults(format, capture, &heads, &frames_at);
    report.hints = search::hints(format, capture, &heads, &strides, &frames_at);
    report
}

impl CaptureReport {
    fn find_first_faults(&mut self, format: &Format, capture: &[u8], heads: &[usize], frames_at: &[usize]) {
        let packets: Vec<usize> = (0..capture.len()).step_by(format.bytes).collect();
        let places = if format.framing == Framing::Packet { &packets } else { heads };
        for &at in places {
            let frame = frames_at.partition_point(|frame| *frame <= at).checked_sub(1);
            let frame = frame.and_then(|frame| frames_at.get(frame));
            if frame.is_some_and(|frame| at < frame + format.bytes) {
                continue;
            }
            match format.inspect(capture.get(at..).unwrap_or_default()) {
                FrameCandidate::BadLength { found, expected } => {
                    self.first_bad_length.get_or_insert(Mismatch { at, expected, found });
                }
                FrameCandidate::BadTrailer => {
                    self.first_bad_trailer_at.get_or_insert(at);
                }
                FrameCandidate::BadChecksum { found, expected } => {
                    self.first_bad_checksum.get_or_insert(Mismatch { at, expected, found });
                }
                FrameCandidate::NoHead | FrameCandidate::Unfinished | FrameCandidate::Good => {}
            }
        }
    }
}

/// Offsets of the frames, and the decoder's statistics.
fn decode(format: &Arc<Format>, capture: &[u8]) -> (Vec<usize>, DecoderStats) {
    let mut decoder = Decoder::new(Arc::clone(format));
    let mut frames_at = Vec::new();
    // In pieces, to limit what the decoder keeps; packets one by one.
    let piece = if format.framing == Framing::Packet { format.bytes } else { 1 << 16 };
    for piece in capture.chunks(piece) {
        decoder.push(piece);
        while let Some(frame) = decoder.next_frame() {
            frames_at.extend(usize::try_from(frame.at));
        }
    }
    (frames_at, decoder.stats())
}

fn first_skipped(frames_at: &[usize], frame_bytes: usize, end: usize) -> Option<usize> {
    let mut next = 0;
    for &at in frames_at {
        if at != next {
            break;
        }
        next += frame_bytes;
    }
    (next < end).then_some(next)
}

/// Distances between sync bytes, most frequent first; of equally frequent ones the shortest first.
fn strides(heads: &[usize]) -> Vec<Stride> {
    let mut counts = BTreeMap::new();
    for (index, at) in heads.iter().enumerate() {
        for behind in heads.iter().skip(index + 1).take(SYNCS_BEHIND) {
            *counts.entry(behind - at).or_insert(0_usize) += 1;
        }
    }
    let mut strides: Vec<Stride> = counts.into_iter().map(|(bytes, count)| Stride { bytes, count }).collect();
    strides.sort_by(|a, b| b.count.cmp(&a.count).then(a.bytes.cmp(&b.bytes)));
    strides
}

#[cfg(test)]
#[path = "capture_tests.rs"]
mod tests;
