//! The channels of a recording, how its chunks are written, and the writer of copies.

use std::{
    collections::BTreeMap,
    io::{self, BufWriter, Write},
    sync::Arc,
    time::Duration,
};

use mcap::{Compression, McapError, WriteOptions, write::NoSeek};
use tactus_schema::{DESCRIPTOR_SET, key::Keys};

use crate::{MessageKind, header::LIBRARY};

/// A chunk is closed and handed to the system once it spans this much time. A reader cannot use a partial chunk, so a
/// killed process loses this much.
pub(crate) const CHUNK_SPAN: Duration = Duration::from_millis(500);

/// A chunk of this size is closed even if it spans less time.
pub(crate) const CHUNK_BYTES: u64 = 256 * 1024;

/// Name of a protobuf schema's and message's encoding in MCAP.
pub(crate) const PROTOBUF: &str = "protobuf";

/// Channels by kind of message, in the order of [`MessageKind::ALL`].
pub(crate) type ChannelIds = [u16; MessageKind::ALL.len()];

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
fn options() -> WriteOptions {
    WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_level(1)
        // In this thread: a chunk has only a few kilobytes.
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
        // A chunk is assembled in memory and written at once, so that the file never contains a partial header.
        .disable_seeking(true)
        .library(library())
}

/// Name of the program in a file's header.
pub(crate) fn library() -> String {
    format!("{LIBRARY} {}", env!("CARGO_PKG_VERSION"))
}

/// An MCAP writer over a sink that is written to in large pieces.
pub(crate) fn writer<W: Write>(sink: W) -> Result<mcap::Writer<NoSeek<BufWriter<W>>>, McapError> {
    options().create(NoSeek::new(BufWriter::with_capacity(
        usize::try_from(CHUNK_BYTES).unwrap_or(usize::MAX),
        sink,
    )))
}

/// Declares the channel of every kind of message. In an empty file they get the ids 1, 2, 3, ...: [`standard_channel`]
/// relies on it.
pub(crate) fn declare<W: Write + io::Seek>(
    mcap: &mut mcap::Writer<W>,
    keys: &Keys,
) -> Result<ChannelIds, McapError> {
    let mut ids = [0; MessageKind::ALL.len()];
    for (id, kind) in ids.iter_mut().zip(MessageKind::ALL) {
        let schema = mcap.add_schema(kind.schema(), PROTOBUF, DESCRIPTOR_SET)?;
        *id = mcap.add_channel(schema, &keys.topic(kind.topic()), PROTOBUF, &BTreeMap::new())?;
    }
    Ok(ids)
}

/// The channel that has this id in every recording of the rig, for a recording whose declarations are lost.
pub(crate) fn standard_channel(id: u16, rig: &str) -> Option<mcap::Channel<'static>> {
    let kind = *MessageKind::ALL.get(usize::from(id).checked_sub(1)?)?;
    Some(mcap::Channel {
        id,
        topic: Keys::new(rig).topic(kind.topic()),
        schema: Some(Arc::new(mcap::Schema {
            id,
            name: kind.schema().into(),
            encoding: PROTOBUF.into(),
            data: DESCRIPTOR_SET.into(),
        })),
        message_encoding: PROTOBUF.into(),
        metadata: BTreeMap::new(),
    })
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
