//! Frames out of a stream of bytes, whatever else is in it.

use std::sync::Arc;

use super::inspect::Verdict;
use super::{Format, Framing};
use crate::unwrapper::{Advance, Unwrapper};

/// Finds frames in a stream that may be cut anywhere and hold garbage, or in packets.
///
/// Feed it with [`push`](Self::push), then call [`next_frame`](Self::next_frame) until it gives
/// `None`; what comes out of a stream does not depend on how it was cut. It holds at most one unfinished
/// frame and what was pushed since, and makes nothing new for a frame.
///
/// With a checksum, the first whole frame after garbage is found when its last byte arrives. Without one, a
/// frame in which sync bytes begin anew may be none, but the end of one and the beginning of the next: it is
/// believed only if sync bytes follow it, so that it is given when these arrive. A longer sync makes that
/// rare.
#[derive(Debug, Clone)]
pub struct Decoder {
    format: Arc<Format>,
    bytes: Vec<u8>,
    /// Bytes before this are done with.
    start: usize,
    /// Bytes that are no longer held.
    gone: u64,
    sequence: Option<Unwrapper>,
    clock: Option<Unwrapper>,
    wire: Vec<f32>,
    counts: Vec<f32>,
    bad: Vec<usize>,
    stats: DecoderStats,
}

/// What a [`Decoder`] met, since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DecoderStats {
    /// Good frames, stale ones too.
    pub frames: u64,
    /// Bytes that were part of no frame.
    pub skipped_bytes: u64,
    /// Sync bytes, or packets, with another length.
    pub bad_lengths: u64,
    /// Frames with another trailer, or that were not followed by sync bytes where those had to decide.
    pub bad_ends: u64,
    /// Frames whose checksum did not hold.
    pub bad_checksums: u64,
    /// Frames that are missing from the sequence.
    pub lost_frames: u64,
    /// Frames that the description calls stale.
    pub stale_frames: u64,
}

/// One reading of all elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecodedFrame<'a> {
    /// Where it begins: bytes that were pushed before it.
    pub at: u64,
    /// The count of frames, unwrapped, if there is one.
    pub sequence: Option<u64>,
    /// Frames that are missing from the sequence just before this one.
    pub lost_before: u64,
    /// The device's clock, unwrapped, if there is one.
    pub tick: Option<u64>,
    /// The ticks of earlier frames are from another clock: this is the first frame, or the clock went back.
    pub new_clock: bool,
    /// The clock stood still and the description says that this means nothing new.
    pub stale: bool,
    /// One for each element, row-major.
    pub counts: &'a [f32],
    /// The elements whose counts mark them as bad, in order.
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

    /// What is decoded.
    pub fn format(&self) -> &Arc<Format> {
        &self.format
    }

    /// Takes what arrived; with [`Framing::Packet`] exactly one packet, or nothing.
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
                Verdict::Unfinished => return None,
                Verdict::NoHead => {}
                Verdict::BadLength { .. } => self.stats.bad_lengths += 1,
                Verdict::BadChecksum { .. } => self.stats.bad_checksums += 1,
                Verdict::Good if self.is_believed(rest)? => return self.accept(),
                Verdict::BadTrailer | Verdict::Good => self.stats.bad_ends += 1,
            }
            self.skip(match self.format.framing {
                Framing::Stream => 1,
                Framing::Packet => self.format.bytes,
            });
        }
    }

    /// What it met.
    pub fn stats(&self) -> DecoderStats {
        self.stats
    }

    fn skip_to_head(&mut self) {
        if self.format.framing == Framing::Stream {
            let rest = self.bytes.get(self.start..).unwrap_or_default();
            self.skip(self.format.find_head(rest).unwrap_or(rest.len()));
        }
    }

    /// Whether the frame at the beginning of `rest` is one; `None` if what decides has not arrived.
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
        // Whatever stands behind the frame, it is no rival's.
        rival.map(|_| true).or(follows.filter(|follows| *follows))
    }

    /// The frame at `start`, which is then done with.
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
