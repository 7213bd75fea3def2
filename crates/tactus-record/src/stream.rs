//! Encodes messages into the channels of a recording, and decides when their chunks are closed.

use std::{array, io, mem};

use crc32fast::Hasher;
use mcap::{McapError, records::op};
use tactus_schema::{DESCRIPTOR_SET, TimeStamp, key::Keys};

use crate::{
    Attachment, MessageKind,
    bytes::{Fields as _, record, short},
    channel::{CHUNK_BYTES, CHUNK_SPAN, PROTOBUF, library, unsigned, wrapped},
    compressor::compress,
    header::Header,
    message::Recorded,
};

/// Encodes the messages of one run as an MCAP stream. It gives out whole records only.
///
/// The `mcap` crate has a writer, too, with which copies are made ([`crate::channel::writer`]). It keeps in memory, for each file, the texts of all schemas, a
/// compressor with its window and the whole index of the chunks: a megabyte, where a service has hundreds of recordings at a time.
/// This one keeps the messages of the present chunk and 48 bytes of each chunk before.
pub(crate) struct ChannelWriter {
    packing: Packing,
    keys: Keys,
    /// Whole records that were not taken yet.
    closed: Vec<u8>,
    /// Length and checksum of those that were.
    taken: u64,
    checksum: Hasher,
    /// Records of the present chunk.
    chunk: Vec<u8>,
    /// Time and place in it of its messages, by kind.
    indexes: [Vec<[u64; 2]>; KINDS],
    chunk_began: Option<TimeStamp>,
    /// Where the first chunk begins: the others follow it without a gap.
    chunks_at: u64,
    chunks: Vec<ClosedChunk>,
    /// Records of the summary, ready to be written.
    attachment_indexes: Vec<u8>,
    metadata_index: Vec<u8>,
    attachments: u32,
    encoded: Vec<u8>,
}

/// How chunks are packed.
#[derive(Debug, Clone, Copy)]
enum Packing {
    Zstd,
    /// To compare bytes with the `mcap` crate's.
    #[cfg(test)]
    Plain,
}

/// What the index needs to know of a chunk.
#[derive(Debug, Clone, Copy)]
struct ClosedChunk {
    /// Times of its first and last message; 0 without any.
    times: [u64; 2],
    packed_bytes: u32,
    bytes: u32,
    /// Number of messages of each kind.
    messages: [u32; KINDS],
}

/// Number of kinds of messages. Each has a schema and a channel, with the same id: its place in [`MessageKind::ALL`], from 1.
const KINDS: usize = MessageKind::ALL.len();

/// The last of these ids: as many schemas and channels are there.
const LAST_ID: u16 = id(MessageKind::ALL[KINDS - 1]);

/// Kind and length of a record.
const HEAD_BYTES: u64 = 9;

impl Packing {
    fn name(self) -> &'static str {
        match self {
            Self::Zstd => "zstd",
            #[cfg(test)]
            Self::Plain => "",
        }
    }

    fn pack(self, bytes: &[u8]) -> io::Result<Vec<u8>> {
        match self {
            Self::Zstd => compress(bytes),
            #[cfg(test)]
            Self::Plain => Ok(bytes.to_vec()),
        }
    }
}

impl ChannelWriter {
    /// Begins a recording with its metadata, attachments, schemas and channels.
    pub(crate) fn new(header: &Header<'_>) -> Result<Self, McapError> {
        Self::packed(header, Packing::Zstd)
    }

    fn packed(header: &Header<'_>, packing: Packing) -> Result<Self, McapError> {
        let mut this = Self {
            packing,
            keys: Keys::new(header.rig.name.clone()),
            closed: mcap::MAGIC.to_vec(),
            taken: 0,
            checksum: Hasher::new(),
            chunk: Vec::new(),
            indexes: Default::default(),
            chunk_began: None,
            chunks_at: 0,
            chunks: Vec::new(),
            attachment_indexes: Vec::new(),
            metadata_index: Vec::new(),
            attachments: 0,
            encoded: Vec::new(),
        };
        record(&mut this.closed, op::HEADER, |body| {
            body.text("");
            body.text(&library());
        });
        this.metadata(&header.metadata().to_record());
        for attachment in header.attachments() {
            this.attachment(&attachment);
        }
        this.chunks_at = this.position();
        for kind in MessageKind::ALL {
            append_schema(&mut this.chunk, kind);
            append_channel(&mut this.chunk, kind, &this.keys);
        }
        this.close_chunk()?;
        // The descriptions are far longer than any chunk that follows.
        this.chunk = Vec::new();
        Ok(this)
    }

    fn metadata(&mut self, metadata: &mcap::records::Metadata) {
        let at = self.position();
        record(&mut self.closed, op::METADATA, |body| {
            body.text(&metadata.name);
            body.list(|pairs| {
                for text in metadata.metadata.iter().flat_map(|(name, value)| [name, value]) {
                    pairs.text(text);
                }
            });
        });
        let bytes = self.position() - at;
        record(&mut self.metadata_index, op::METADATA_INDEX, |body| {
            body.u64(at);
            body.u64(bytes);
            body.text(&metadata.name);
        });
    }

    fn attachment(&mut self, attachment: &Attachment) {
        let Attachment { name, media_type, written, data } = attachment;
        let written = unsigned(written.ns());
        let at = self.position();
        record(&mut self.closed, op::ATTACHMENT, |body| {
            let fields_at = body.len();
            body.u64(written);
            body.u64(written);
            body.text(name);
            body.text(media_type);
            body.u64(data.len() as u64);
            body.extend_from_slice(data);
            body.u32(crc32fast::hash(&body[fields_at..]));
        });
        let bytes = self.position() - at;
        record(&mut self.attachment_indexes, op::ATTACHMENT_INDEX, |body| {
            for number in [at, bytes, written, written, data.len() as u64] {
                body.u64(number);
            }
            body.text(name);
            body.text(media_type);
        });
        self.attachments += 1;
    }

    /// The whole records that were finished since the last call.
    pub(crate) fn take_closed(&mut self) -> Vec<u8> {
        if !self.closed.is_empty() {
            self.checksum.update(&self.closed);
            self.taken += self.closed.len() as u64;
        }
        mem::take(&mut self.closed)
    }

    /// Bytes of all records so far.
    fn position(&self) -> u64 {
        self.taken + self.closed.len() as u64
    }

    /// Closes the current chunk.
    pub(crate) fn close_chunk(&mut self) -> Result<(), McapError> {
        self.chunk_began = None;
        if self.chunk.is_empty() {
            return Ok(());
        }
        let packed = self.packing.pack(&self.chunk)?;
        let times = || self.indexes.iter().flatten().map(|[time, _]| *time);
        let closed = ClosedChunk {
            times: [times().min().unwrap_or(0), times().max().unwrap_or(0)],
            packed_bytes: short(packed.len()),
            bytes: short(self.chunk.len()),
            messages: array::from_fn(|kind| short(self.indexes[kind].len())),
        };
        record(&mut self.closed, op::CHUNK, |body| {
            let [first, last] = closed.times;
            body.u64(first);
            body.u64(last);
            body.u64(self.chunk.len() as u64);
            body.u32(crc32fast::hash(&self.chunk));
            body.text(self.packing.name());
            body.u64(packed.len() as u64);
            body.extend_from_slice(&packed);
        });
        for (id, index) in (1..).zip(&mut self.indexes).filter(|(_, index)| !index.is_empty()) {
            record(&mut self.closed, op::MESSAGE_INDEX, |body| {
                body.u16(id);
                body.list(|entries| index.iter().flatten().for_each(|number| entries.u64(*number)));
            });
            index.clear();
        }
        self.chunk.clear();
        self.chunks.push(closed);
        Ok(())
    }

    /// Closes the current chunk and writes the summary and the end mark. Nothing may follow.
    pub(crate) fn finish(&mut self) -> Result<(), McapError> {
        self.close_chunk()?;
        let mut checksum = self.checksum.clone();
        checksum.update(&self.closed);
        record(&mut self.closed, op::DATA_END, |body| body.u32(checksum.finalize()));
        let (before, summary_at) = (self.closed.len(), self.position());
        let offsets = self.append_summary();
        let offsets_at = self.position();
        for (opcode, [start, end]) in offsets {
            record(&mut self.closed, op::SUMMARY_OFFSET, |body| {
                body.push(opcode);
                body.u64(start);
                body.u64(end - start);
            });
        }
        // Its checksum is of the summary and of the footer up to itself.
        record(&mut self.closed, op::FOOTER, |body| {
            body.u64(summary_at);
            body.u64(offsets_at);
            body.u32(0);
        });
        let checksum_at = self.closed.len() - size_of::<u32>();
        let checksum = crc32fast::hash(&self.closed[before..checksum_at]);
        self.closed[checksum_at..].copy_from_slice(&checksum.to_le_bytes());
        self.closed.extend_from_slice(mcap::MAGIC);
        Ok(())
    }

    /// Appends what a reader wants to know first. Returns the kinds of its records, and where each group begins and ends.
    fn append_summary(&mut self) -> Vec<(u8, [u64; 2])> {
        let mut offsets = Vec::new();
        let mut begin = self.position();
        let mut group = |this: &Self, opcode: u8| {
            let end = this.position();
            if begin < end {
                offsets.push((opcode, [begin, end]));
            }
            begin = end;
        };
        for kind in MessageKind::ALL {
            append_schema(&mut self.closed, kind);
        }
        group(self, op::SCHEMA);
        for kind in MessageKind::ALL {
            append_channel(&mut self.closed, kind, &self.keys);
        }
        group(self, op::CHANNEL);
        self.append_statistics();
        group(self, op::STATISTICS);
        let mut at = self.chunks_at;
        for chunk in &self.chunks {
            at = chunk.append_index(&mut self.closed, self.packing.name(), at);
        }
        group(self, op::CHUNK_INDEX);
        self.closed.append(&mut self.attachment_indexes);
        group(self, op::ATTACHMENT_INDEX);
        self.closed.append(&mut self.metadata_index);
        group(self, op::METADATA_INDEX);
        offsets
    }

    fn append_statistics(&mut self) {
        let of_kind = |kind: usize| self.chunks.iter().map(|chunk| u64::from(chunk.messages[kind])).sum();
        let messages: [u64; KINDS] = array::from_fn(of_kind);
        let told = self.chunks.iter().filter(|chunk| chunk.messages != [0; KINDS]);
        let first = told.clone().map(|chunk| chunk.times[0]).min().unwrap_or(0);
        let last = told.map(|chunk| chunk.times[1]).max().unwrap_or(0);
        let (attachments, chunks) = (self.attachments, short(self.chunks.len()));
        record(&mut self.closed, op::STATISTICS, |body| {
            body.u64(messages.iter().sum());
            // Schemas, channels, metadata records.
            body.u16(LAST_ID);
            for number in [LAST_ID.into(), attachments, 1, chunks] {
                body.u32(number);
            }
            body.u64(first);
            body.u64(last);
            body.list(|pairs| {
                for (id, messages) in (1..).zip(messages).filter(|(_, messages)| *messages > 0) {
                    pairs.u16(id);
                    pairs.u64(messages);
                }
            });
        });
    }

    /// Writes a message to the channel of its kind, and first closes the current chunk if it spans [`CHUNK_SPAN`].
    pub(crate) fn write<M: Recorded>(
        &mut self,
        message: &M,
        seq: u64,
        at: TimeStamp,
    ) -> Result<(), McapError> {
        // A clock that runs backwards closes the chunk, too.
        let spans = |began: TimeStamp| at.mono < began.mono || at.mono.since(began.mono) >= CHUNK_SPAN;
        if self.chunk_began.is_some_and(spans) || self.chunk.len() as u64 > CHUNK_BYTES {
            self.close_chunk()?;
        }
        self.chunk_began.get_or_insert(at);
        self.encoded.clear();
        message.encode(&mut self.encoded);
        let time = unsigned(at.wall.ns());
        self.indexes[M::KIND as usize].push([time, self.chunk.len() as u64]);
        record(&mut self.chunk, op::MESSAGE, |body| {
            body.u16(id(M::KIND));
            body.u32(wrapped(seq));
            body.u64(time);
            body.u64(time);
            body.extend_from_slice(&self.encoded);
        });
        Ok(())
    }
}

impl ClosedChunk {
    /// Appends the chunk's entry in the index of a file in which it begins at `at`. Returns where the next one begins.
    fn append_index(&self, bytes: &mut Vec<u8>, packing: &str, at: u64) -> u64 {
        // Times, size and checksum, name of the packing, size.
        let before_data = 16 + 8 + 4 + 4 + packing.len() as u64 + 8;
        let chunk_bytes = HEAD_BYTES + before_data + u64::from(self.packed_bytes);
        // Channel, length of the list, time and place of each message.
        let index_bytes = |messages: u32| HEAD_BYTES + 2 + 4 + 16 * u64::from(messages);
        let of_kinds = || (1..).zip(self.messages).filter(|(_, messages)| *messages > 0);
        let all_indexes = of_kinds().map(|(_, messages)| index_bytes(messages)).sum();
        record(bytes, op::CHUNK_INDEX, |body| {
            let [first, last] = self.times;
            for number in [first, last, at, chunk_bytes] {
                body.u64(number);
            }
            body.list(|pairs| {
                let mut index_at = at + chunk_bytes;
                for (id, messages) in of_kinds() {
                    pairs.u16(id);
                    pairs.u64(index_at);
                    index_at += index_bytes(messages);
                }
            });
            body.u64(all_indexes);
            body.text(packing);
            body.u64(self.packed_bytes.into());
            body.u64(self.bytes.into());
        });
        at + chunk_bytes + all_indexes
    }
}

/// The id of a kind's schema and of its channel.
const fn id(kind: MessageKind) -> u16 {
    kind as u16 + 1
}

fn append_schema(bytes: &mut Vec<u8>, kind: MessageKind) {
    record(bytes, op::SCHEMA, |body| {
        body.u16(id(kind));
        body.text(kind.schema());
        body.text(PROTOBUF);
        body.blob(DESCRIPTOR_SET);
    });
}

fn append_channel(bytes: &mut Vec<u8>, kind: MessageKind, keys: &Keys) {
    record(bytes, op::CHANNEL, |body| {
        body.u16(id(kind));
        body.u16(id(kind));
        body.text(&keys.topic(kind.topic()));
        body.text(PROTOBUF);
        // No metadata.
        body.list(|_| ());
    });
}

#[cfg(test)]
#[path = "stream_tests.rs"]
mod tests;
