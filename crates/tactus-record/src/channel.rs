//! Writes messages to the channels of a recording, and decides when they reach the file.

use std::{
    collections::BTreeMap,
    io::{BufWriter, Write},
    time::Duration,
};

use mcap::{Compression, McapError, WriteOptions, records::MessageHeader, write::NoSeek};
use tactus_schema::{DESCRIPTOR_SET, TimeStamp, key::Keys};

use crate::{MessageKind, header::Header, message::Recorded};

/// A chunk is closed and handed to the system once it spans this much time. A reader cannot use a partial chunk, so a
/// killed process loses this much.
const CHUNK_SPAN: Duration = Duration::from_millis(500);

/// A chunk of this size is closed even if it spans less time.
const CHUNK_BYTES: u64 = 256 * 1024;

/// Name of a protobuf schema's and message's encoding in MCAP.
pub(crate) const PROTOBUF: &str = "protobuf";

type Output<W> = NoSeek<BufWriter<W>>;

/// Writes the messages of one run into an MCAP stream.
pub(crate) struct ChannelWriter<W: Write> {
    mcap: mcap::Writer<Output<W>>,
    /// Channels by kind of message.
    ids: [u16; MessageKind::ALL.len()],
    encoded: Vec<u8>,
    chunk_began: Option<TimeStamp>,
    failed: bool,
}

/// How recordings are written.
///
/// Compression is cheap: one core records 60,000 frames/s (2,000 sensors at 30 Hz) in an eighth of its time, at less than
/// half the bytes. A higher level gains hardly anything on chunks this small. Measured by `examples/throughput.rs` on one
/// core of a small server, with 48 elements, 30 Hz, chunks of half a second and message indexes:
///
/// | compression | frames/s | bytes/frame |
/// |---|---|---|
/// | none | 1,100,000 | 276 |
/// | zstd 1 | 500,000 | 122 |
/// | zstd 3 | 490,000 | 119 |
pub(crate) fn options() -> WriteOptions {
    WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_level(1)
        // In this thread: a chunk has only a few kilobytes.
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
        // A chunk is assembled in memory and written at once, so that the file never contains a partial header.
        .disable_seeking(true)
        .library(concat!("tactus-record ", env!("CARGO_PKG_VERSION")))
}

/// An MCAP writer over a sink that is written to in large pieces.
pub(crate) fn writer<W: Write>(sink: W) -> Result<mcap::Writer<Output<W>>, McapError> {
    options().create(NoSeek::new(BufWriter::with_capacity(
        usize::try_from(CHUNK_BYTES).unwrap_or(usize::MAX),
        sink,
    )))
}

impl<W: Write> ChannelWriter<W> {
    /// Begins a recording: metadata, attachments, schemas and channels reach the sink before this returns.
    pub(crate) fn new(sink: W, header: &Header<'_>) -> Result<Self, McapError> {
        let mut mcap = writer(sink)?;
        mcap.write_metadata(&header.metadata().to_record())?;
        for attachment in header.attachments() {
            mcap.attach(&mcap::Attachment {
                log_time: unsigned(attachment.written.ns()),
                create_time: unsigned(attachment.written.ns()),
                name: attachment.name,
                media_type: attachment.media_type,
                data: attachment.data.into(),
            })?;
        }
        let ids = declare(&mut mcap, &Keys::new(header.rig.name.clone()))?;
        mcap.flush()?;
        Ok(Self { mcap, ids, encoded: Vec::new(), chunk_began: None, failed: false })
    }

    /// Closes the current chunk and gives it to the system.
    pub(crate) fn flush(&mut self) -> Result<(), McapError> {
        self.once_failed_always()?;
        self.chunk_began = None;
        let flushed = self.mcap.flush();
        self.failed = flushed.is_err();
        flushed
    }

    /// Writes the summary and returns the sink, which then contains everything.
    pub(crate) fn finish(mut self) -> Result<W, McapError> {
        self.once_failed_always()?;
        self.mcap.finish()?;
        let buffered = self.mcap.into_inner().into_inner();
        buffered.into_inner().map_err(|error| McapError::Io(error.into_error()))
    }

    /// Writes a message to the channel of its kind, and first closes the current chunk if it spans [`CHUNK_SPAN`].
    pub(crate) fn write<M: Recorded>(
        &mut self,
        message: &M,
        seq: u64,
        at: TimeStamp,
    ) -> Result<(), McapError> {
        self.once_failed_always()?;
        // A clock that runs backwards closes the chunk, too.
        let spans = |began: TimeStamp| at.mono < began.mono || at.mono.since(began.mono) >= CHUNK_SPAN;
        if self.chunk_began.is_some_and(spans) {
            self.flush()?;
        }
        self.chunk_began.get_or_insert(at);
        self.encoded.clear();
        message.encode(&mut self.encoded);
        let channel_id = self.ids[M::KIND as usize];
        let log_time = unsigned(at.wall.ns());
        let header = MessageHeader { channel_id, sequence: wrapped(seq), log_time, publish_time: log_time };
        let written = self.mcap.write_to_known_channel(&header, &self.encoded);
        self.failed = written.is_err();
        written
    }

    /// After an error the sink may hold any part of its last input, so nothing may follow.
    fn once_failed_always(&self) -> Result<(), McapError> {
        if self.failed { Err(McapError::AttemptedWriteAfterFailure) } else { Ok(()) }
    }
}

/// Declares the channel of every kind of message; their ids, in the order of [`MessageKind::ALL`].
fn declare<W: Write>(
    mcap: &mut mcap::Writer<Output<W>>,
    keys: &Keys,
) -> Result<[u16; MessageKind::ALL.len()], McapError> {
    let mut ids = [0; MessageKind::ALL.len()];
    for (id, kind) in ids.iter_mut().zip(MessageKind::ALL) {
        let schema = mcap.add_schema(kind.schema(), PROTOBUF, DESCRIPTOR_SET)?;
        *id = mcap.add_channel(schema, &keys.topic(kind.topic()), PROTOBUF, &BTreeMap::new())?;
    }
    Ok(ids)
}

/// MCAP has no times before 1970; they become 0.
pub(crate) fn unsigned(ns: i64) -> u64 {
    u64::try_from(ns).unwrap_or(0)
}

/// MCAP's sequence numbers have 32 bits; the message itself holds all 64.
pub(crate) fn wrapped(seq: u64) -> u32 {
    #[expect(clippy::cast_possible_truncation, reason = "the low 32 bits are what is wanted")]
    let low = seq as u32;
    low
}

#[cfg(test)]
#[path = "channel_tests.rs"]
mod tests;
