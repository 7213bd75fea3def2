//! Reads an MCAP file from its start to its end, or to the first damage.

use std::{
    io::{self, Read},
    sync::Arc,
};

use mcap::{
    McapError,
    read::ChannelAccumulator,
    records::{MessageHeader, Record as McapRecord, op},
    sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions},
};
use serde::Serialize;
use tactus_schema::WallTime;

use crate::{header::Attachment, layout};

/// No record and no unpacked chunk is larger; a length beyond it is damage.
const RECORD_MAX_BYTES: usize = 64 * 1024 * 1024;

/// At most this much is read at once, so that a wrong length costs no memory.
const READ_BYTES: usize = 1024 * 1024;

/// How much of a file could be read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum Completeness {
    /// All of it, to the end mark, with every checksum right.
    Complete,
    /// Everything before a byte; what should follow is missing or damaged.
    Truncated {
        /// Everything before this byte was read.
        at_byte: u64,
        /// What is wrong there.
        reason: String,
    },
}

/// The items of a file that a recording uses.
pub(crate) enum ScanItem {
    Metadata(mcap::records::Metadata),
    Attachment(Attachment),
    Message(RawMessage),
}

/// An encoded message with its channel and header.
pub(crate) struct RawMessage {
    pub(crate) channel: Arc<mcap::Channel<'static>>,
    pub(crate) header: MessageHeader,
    pub(crate) data: Vec<u8>,
}

/// Gives the file's items in order. Chunks are unpacked and their checksums compared before anything in them is given.
pub(crate) struct Scan<R> {
    source: R,
    mcap: LinearReader,
    channels: ChannelAccumulator<'static>,
    /// Bytes given to the parser; it asks for no more than the current record needs.
    taken_bytes: u64,
    /// Bytes up to the end of the last good record.
    good_bytes: u64,
    in_summary: bool,
    end: Option<Completeness>,
}

impl<R: Read> Scan<R> {
    pub(crate) fn new(source: R) -> Self {
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_check_finishes_after_end_magic(true)
            .with_record_length_limit(RECORD_MAX_BYTES);
        Self {
            source,
            mcap: LinearReader::new_with_options(options),
            channels: ChannelAccumulator::default(),
            taken_bytes: 0,
            good_bytes: 0,
            in_summary: false,
            end: None,
        }
    }

    /// How much could be read; `None` until the end is reached.
    pub(crate) fn completeness(&self) -> Option<&Completeness> {
        self.end.as_ref()
    }

    /// Ends the scan at what was just given, which proved to be damaged.
    pub(crate) fn give_up(&mut self, reason: String) {
        self.end = Some(Completeness::Truncated { at_byte: self.good_bytes, reason });
    }

    /// The next item; `None` at the end, whole or not. Errors are the source's own.
    pub(crate) fn next_item(&mut self) -> io::Result<Option<ScanItem>> {
        while self.end.is_none() {
            let given = match self.mcap.next_event() {
                None => {
                    self.end = Some(Completeness::Complete);
                    continue;
                }
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => {
                    self.supply(bytes.min(READ_BYTES))?;
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    let given =
                        if self.in_summary { Ok(None) } else { item(&mut self.channels, opcode, data) };
                    self.in_summary |= opcode == op::DATA_END;
                    given
                }
                Some(Err(McapError::UnexpectedEof)) => Err("the file ends here, without its end mark".into()),
                Some(Err(error)) => Err(error.to_string()),
            };
            match given {
                Ok(item) => {
                    self.good_bytes = self.taken_bytes;
                    if item.is_some() {
                        return Ok(item);
                    }
                }
                Err(reason) => self.give_up(reason),
            }
        }
        Ok(None)
    }

    fn supply(&mut self, bytes: usize) -> io::Result<()> {
        let read = loop {
            match self.source.read(self.mcap.insert(bytes)) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                read => break read?,
            }
        };
        self.mcap.notify_read(read);
        self.taken_bytes += read as u64;
        Ok(())
    }
}

/// Reads one record; `None` if recordings do not use its kind. The error says what is wrong with it.
fn item(
    channels: &mut ChannelAccumulator<'static>,
    opcode: u8,
    body: &[u8],
) -> Result<Option<ScanItem>, String> {
    if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::ATTACHMENT) {
        return Ok(None);
    }
    if !layout::fits(opcode, body) {
        return Err(format!("a record of kind {opcode} is damaged: its lengths contradict each other"));
    }
    parsed(channels, opcode, body).map_err(|error| error.to_string())
}

fn parsed(
    channels: &mut ChannelAccumulator<'static>,
    opcode: u8,
    body: &[u8],
) -> Result<Option<ScanItem>, McapError> {
    #[expect(clippy::wildcard_enum_match_arm, reason = "the caller picked the kinds that matter")]
    Ok(match mcap::parse_record(opcode, body)? {
        McapRecord::Schema { header, data } => {
            channels.add_schema_from_slice(header, &data)?;
            None
        }
        McapRecord::Channel(channel) => {
            channels.add_channel(channel)?;
            None
        }
        McapRecord::Message { header, data } => {
            let unknown = McapError::UnknownChannel(header.sequence, header.channel_id);
            let channel = channels.get(header.channel_id).ok_or(unknown)?;
            Some(ScanItem::Message(RawMessage { channel, header, data: data.into_owned() }))
        }
        McapRecord::Metadata(metadata) => Some(ScanItem::Metadata(metadata)),
        McapRecord::Attachment { header, data, .. } => Some(ScanItem::Attachment(Attachment {
            name: header.name,
            media_type: header.media_type,
            written: WallTime::from_ns(i64::try_from(header.log_time).unwrap_or(i64::MAX)),
            data: data.into_owned(),
        })),
        _ => None,
    })
}
