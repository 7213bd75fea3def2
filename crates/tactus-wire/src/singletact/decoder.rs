//! Requests and replies out of a stream of bytes, whatever else is in it.

use std::ops::Range;

use super::{HEADER, Reply, Request, USB_HEADER, reply, request};

/// Finds packets in a stream that may contain garbage.
///
/// Call [`push`](Self::push) with each read. Then call [`next_reply`](Self::next_reply) on the host, or
/// [`next_request`](Self::next_request) on the device, until it returns `None`. The result does not depend on how the bytes
/// arrive. At most one incomplete packet and the last read are kept.
///
/// There is no checksum. A packet is accepted if header, address, length and footer fit; of overlapping packets the one
/// that ends first, and of those the one that begins last. So the first complete packet after garbage is found when its
/// last byte arrives, unless the garbage ends with a complete header whose length happens to lead to four footer bytes
/// within that packet.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    bytes: Vec<u8>,
    /// Bytes before this index have been used.
    start: usize,
    /// A read request ended at `start`, so a zero there still belongs to it.
    zero_belongs: bool,
    stats: DecoderStats,
}

/// What a [`Decoder`] has received besides good packets, since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DecoderStats {
    /// Bytes that belonged to no packet.
    pub skipped_bytes: u64,
}

/// What begins at a header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    /// No packet.
    Impossible,
    /// A possible packet that has not arrived completely.
    Unfinished,
    /// A complete packet.
    Whole { length: usize },
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

    /// The next reply, or `None` until more is pushed.
    pub fn next_reply(&mut self) -> Option<Reply<'_>> {
        let packet = self.next_packet(reply::extent)?;
        Reply::parse(self.bytes.get(packet)?)
    }

    /// The next request, or `None` until more is pushed.
    pub fn next_request(&mut self) -> Option<Request<'_>> {
        if self.zero_belongs
            && let Some(first) = self.bytes.get(self.start)
        {
            self.start += usize::from(*first == 0);
            self.zero_belongs = false;
        }
        let packet = self.next_packet(request::extent)?;
        self.zero_belongs = packet.len() == READ_BYTES;
        Request::parse(self.bytes.get(packet)?)
    }

    /// What it has received besides good packets.
    pub fn stats(&self) -> DecoderStats {
        self.stats
    }

    fn next_packet(&mut self, extent: impl Fn(&[u8]) -> Extent) -> Option<Range<usize>> {
        loop {
            self.skip_to_header();
            let outer_at = self.start;
            let (limit, whole) = match extent(self.bytes.get(outer_at..)?) {
                Extent::Impossible => {
                    self.skip(1);
                    continue;
                }
                Extent::Unfinished => (self.bytes.len() + 1, None),
                Extent::Whole { length } => (outer_at + length, Some(outer_at..outer_at + length)),
            };
            let packet = self.first_to_end_within(outer_at + 1, limit, &extent).or(whole)?;
            self.skip(packet.start - outer_at);
            self.start = packet.end;
            return Some(packet);
        }
    }

    /// Of the packets that begin at `from` or later and end by `limit`, the one that ends first; of several, the one that
    /// begins last.
    fn first_to_end_within(
        &self,
        from: usize,
        mut limit: usize,
        extent: impl Fn(&[u8]) -> Extent,
    ) -> Option<Range<usize>> {
        let mut first = None;
        let mut at = from;
        while let Some(offset) = find_header(self.bytes.get(at..limit.min(self.bytes.len()))?) {
            at += offset;
            if let Extent::Whole { length } = extent(self.bytes.get(at..)?)
                && at + length <= limit
            {
                first = Some(at..at + length);
                limit = at + length;
            }
            at += 1;
        }
        first
    }

    /// Skips to the next header; without one, to the end except for what may become one.
    fn skip_to_header(&mut self) {
        let rest = self.bytes.get(self.start..).unwrap_or_default();
        let skipped = find_header(rest).unwrap_or_else(|| {
            let last = rest.last().copied().filter(|byte| [HEADER, USB_HEADER].contains(byte));
            let begun = rest.iter().rev().take(3).take_while(|byte| Some(**byte) == last).count();
            rest.len() - begun
        });
        self.skip(skipped);
    }

    fn skip(&mut self, count: usize) {
        self.stats.skipped_bytes += count as u64;
        self.start += count;
    }
}

/// Length of a read request without the zero behind it. No other request is that short.
const READ_BYTES: usize = 15;

/// Offset of the first four header bytes in a row, of either board. Wherever they begin, one of them is the last byte of a chunk
/// of four, so that most chunks are passed by a look at one byte.
fn find_header(bytes: &[u8]) -> Option<usize> {
    let (chunks, _) = bytes.as_chunks::<4>();
    let touched = |(_, chunk): &(usize, &[u8; 4])| [HEADER, USB_HEADER].contains(&chunk[3]);
    chunks.iter().enumerate().filter(touched).find_map(|(chunk, _)| {
        let mut begins = bytes.get(4 * chunk..)?.array_windows().take(4);
        let offset = begins.position(|four| *four == [HEADER; 4] || *four == [USB_HEADER; 4])?;
        Some(4 * chunk + offset)
    })
}

#[cfg(test)]
#[path = "decoder_tests.rs"]
mod tests;
