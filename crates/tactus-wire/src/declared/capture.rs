//! A recording held against a description.

mod hint;
mod search;

use std::collections::BTreeMap;
use std::sync::Arc;

pub use hint::Hint;

use super::inspect::Verdict;
use super::sniff::find;
use super::{Decoder, DecoderStats, Format, Framing};

/// Strides that are told.
const STRIDES_TOLD: usize = 5;
/// A sync is compared with so many behind it.
const SYNCS_BEHIND: usize = 8;

/// What [`check_capture`] saw.
#[derive(Debug, Clone, PartialEq)]
pub struct CaptureReport {
    /// Length of the capture in bytes.
    pub bytes: usize,
    /// What the decoder made of it.
    pub stats: DecoderStats,
    /// Where the first frame begins.
    pub first_frame_at: Option<usize>,
    /// The first byte that is part of no frame.
    pub first_skipped_at: Option<usize>,
    /// How often the sync bytes are there, within frames too.
    pub syncs: usize,
    /// Distances from one sync to another up to eight further, the most frequent first; five at most.
    pub strides: Vec<Stride>,
    /// The first frame whose length field says something else.
    pub first_bad_length: Option<Mismatch>,
    /// The first frame that does not end with the trailer.
    pub first_bad_trailer_at: Option<usize>,
    /// The first frame whose checksum does not hold.
    pub first_bad_checksum: Option<Mismatch>,
    /// How the description may be corrected, the most telling first.
    pub hints: Vec<Hint>,
}

/// A distance between sync bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stride {
    /// In bytes.
    pub bytes: usize,
    /// How often.
    pub count: usize,
}

/// A number that should be another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mismatch {
    /// Where the frame begins.
    pub at: usize,
    /// What it should be.
    pub expected: u64,
    /// What is there.
    pub found: u64,
}

/// Holds a capture against a description: what decodes, where it fails first, and how the description may be
/// corrected.
///
/// A capture of packets is their bytes one behind the other.
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
                Verdict::BadLength { found, expected } => {
                    self.first_bad_length.get_or_insert(Mismatch { at, expected, found });
                }
                Verdict::BadTrailer => {
                    self.first_bad_trailer_at.get_or_insert(at);
                }
                Verdict::BadChecksum { found, expected } => {
                    self.first_bad_checksum.get_or_insert(Mismatch { at, expected, found });
                }
                Verdict::NoHead | Verdict::Unfinished | Verdict::Good => {}
            }
        }
    }
}

/// Where frames begin.
fn decode(format: &Arc<Format>, capture: &[u8]) -> (Vec<usize>, DecoderStats) {
    let mut decoder = Decoder::new(Arc::clone(format));
    let mut frames_at = Vec::new();
    // In pieces, so that it holds little; packets one by one.
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

/// Distances between sync bytes, the most frequent first, of equally frequent ones the shortest.
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
