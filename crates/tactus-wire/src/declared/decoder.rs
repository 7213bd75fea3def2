//! Finds frames in a stream of bytes that may contain garbage.

use std::sync::Arc;

use super::inspect::FrameCandidate;
use super::{Format, Framing};
use crate::unwrapper::{Advance, Unwrapper};

/// Finds frames in packets, or in a stream that may contain garbage.
///
/// Call [`push`](Self::push) with each read, then [`next_frame`](Self::next_frame) until it returns `None`. The result for a
/// stream does not depend on how the bytes arrive. At most one incomplete frame and the last read are kept. No memory is
/// allocated for a frame.
///
/// With a checksum, the first complete frame after garbage is found when its last byte arrives. Without one, a frame that
/// contains sync bytes may really be the end of one frame and the beginning of the next. It is therefore accepted only if
/// sync bytes follow it, and returned when these arrive. A longer sync makes this rare.
#[derive(Debug, Clone)]
pub struct Decoder {
    format: Arc<Format>,
    bytes: Vec<u8>,
    /// Bytes before this index have been used.
    start: usize,
    /// Number of bytes that are no longer kept.
    gone: u64,
    sequence: Option<Unwrapper>,
    clock: Option<Unwrapper>,
    wire: Vec<f32>,
    counts: Vec<f32>,
    bad: Vec<usize>,
    stats: DecoderStats,
}

/// What a [`Decoder`] has received, since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DecoderStats {
    /// Good frames, including stale ones.
    pub frames: u64,
    /// Bytes that belonged to no frame.
    pub skipped_bytes: u64,
    /// Packets, or length fields behind sync bytes, with a wrong length.
    pub bad_lengths: u64,
    /// Frames with a wrong trailer, or without the sync bytes that had to follow to accept them.
    pub bad_ends: u64,
    /// Frames with a wrong checksum.
    pub bad_checksums: u64,
    /// Frames that are missing by the device's count.
    pub lost_frames: u64,
    /// Frames that the description calls stale.
    pub stale_frames: u64,
}

/// One reading of all elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecodedFrame<'a> {
    /// Offset of its first byte from the first byte that was pushed.
    pub at: u64,
    /// The device's frame count, unwrapped, if there is one.
    pub sequence: Option<u64>,
    /// Frames that are missing just before this one, by the device's count.
    pub lost_before: u64,
    /// The device's clock, unwrapped, if there is one.
    pub tick: Option<u64>,
    /// True if ticks of earlier frames cannot be compared: this is the first frame, or the clock went back.
    pub new_clock: bool,
    /// True if the clock did not advance, and the description says that such a frame holds nothing new.
    pub stale: bool,
    /// Counts of all elements, row-major.
    pub counts: &'a [f32],
    /// Indices of the elements that are marked as bad, ascending.
    pub bad: &'a [usize],
}

impl Decoder {
    /// An empty decoder.
    pub fn new(format: Arc<Format>) -> Self {
        let elements = format.samples.elements;
        Self {
            bytes: Vec::with_capacity(2 * format.bytes),
            start: 0,
            gone: 0,
            sequence: format.sequence.map(|sequence| Unwrapper::new(sequence.wrap)),
            clock: format.timestamp.map(|timestamp| Unwrapper::new(timestamp.wrap)),
            wire: Vec::with_capacity(elements),
            counts: Vec::with_capacity(elements),
            bad: Vec::new(),
            stats: DecoderStats::default(),
            format,
        }
    }

    /// The format that is decoded.
    pub fn format(&self) -> &Arc<Format> {
        &self.format
    }

    /// Takes the bytes of a read; with [`Framing::Packet`] exactly one packet, or nothing.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.start);
        self.gone += self.start as u64;
        self.start = 0;
        if self.format.framing == Framing::Packet && bytes.len() != self.format.bytes && !bytes.is_empty() {
            self.stats.bad_lengths += 1;
            self.stats.skipped_bytes += bytes.len() as u64;
            self.gone += bytes.len() as u64;
            return;
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// The next frame, or `None` until more is pushed.
    pub fn next_frame(&mut self) -> Option<DecodedFrame<'_>> {
        loop {
            self.skip_to_head();
            let rest = self.bytes.get(self.start..)?;
            match self.format.inspect(rest) {
                FrameCandidate::Unfinished => return None,
                FrameCandidate::NoHead => {}
                FrameCandidate::BadLength { .. } => self.stats.bad_lengths += 1,
                FrameCandidate::BadChecksum { .. } => self.stats.bad_checksums += 1,
                FrameCandidate::Good if self.is_believed(rest)? => return self.accept(),
                FrameCandidate::BadTrailer | FrameCandidate::Good => self.stats.bad_ends += 1,
            }
            self.skip(match self.format.framing {
                Framing::Stream => 1,
                Framing::Packet => self.format.bytes,
            });
        }
    }

    /// What it has received.
    pub fn stats(&self) -> DecoderStats {
        self.stats
    }

    fn skip_to_head(&mut self) {
        if self.format.framing == Framing::Stream {
            let rest = self.bytes.get(self.start..).unwrap_or_default();
            self.skip(self.format.find_head(rest).unwrap_or(rest.len()));
        }
    }

    /// Whether the frame at the beginning of `rest` is accepted; `None` if that needs more bytes.
    fn is_believed(&self, rest: &[u8]) -> Option<bool> {
        let format = &*self.format;
        if format.framing == Framing::Packet || format.checksum.is_some() {
            return Some(true);
        }
        let (_, next) = rest.split_at_checked(format.bytes)?;
        let follows = format.stands_at(next);
        let mut rival = Some(false);
        let mut at = 1;
        while let Some(offset) = rest.get(at..).and_then(|inner| format.find_head(inner))
            && at + offset < format.bytes
        {
            at += offset;
            match format.stands_at(rest.get(at..)?) {
                Some(true) => return follows,
                Some(false) => {}
                None => rival = None,
            }
            at += 1;
        }
        // No other frame can begin within this one, whatever follows it.
        rival.map(|_| true).or(follows.filter(|follows| *follows))
    }

    /// Decodes and takes the frame at `start`.
    fn accept(&mut self) -> Option<DecodedFrame<'_>> {
        let format = &*self.format;
        let frame = self.bytes.get(self.start..)?.get(..format.bytes)?;
        let at = self.gone + self.start as u64;
        let read = |field: Option<super::Field>| field.and_then(|field| field.read(frame));
        let sequence = read(format.sequence.map(|sequence| sequence.field))
            .and_then(|raw| self.sequence.as_mut().map(|sequence| sequence.advance(raw)));
        let clock = read(format.timestamp.map(|timestamp| timestamp.field))
            .and_then(|raw| self.clock.as_mut().map(|clock| clock.advance(raw)));
        let lost_before = match sequence {
            Some(Advance::Ahead { by, .. }) => by - 1,
            Some(Advance::Anew { .. } | Advance::Same { .. }) | None => 0,
        };
        let may_be_stale = format.timestamp.is_some_and(|timestamp| timestamp.unchanged_is_stale);
        let stale = may_be_stale && matches!(clock, Some(Advance::Same { .. }));
        format.samples.decode(frame, &mut self.wire, &mut self.counts);
        format.samples.find_bad(&self.counts, &mut self.bad);
        self.start += format.bytes;
        self.stats.frames += 1;
        self.stats.lost_frames = self.stats.lost_frames.saturating_add(lost_before);
        self.stats.stale_frames += u64::from(stale);
        Some(DecodedFrame {
            at,
            sequence: sequence.map(Advance::total),
            lost_before,
            tick: clock.map(Advance::total),
            new_clock: matches!(clock, Some(Advance::Anew { .. })),
            stale,
            counts: &self.counts,
            bad: &self.bad,
        })
    }

    fn skip(&mut self, count: usize) {
        self.stats.skipped_bytes += count as u64;
        self.start += count;
    }
}

#[cfg(test)]
#[path = "decoder_tests.rs"]
mod tests;
