//! Reads an MCAP file from its start to its end, around whatever is damaged.
//!
//! After damage the scan looks, byte by byte, for the next record. Lengths that agree with each other make a record
//! plausible; chunks and attachments must have the right checksum, too. A chunk, attachment or metadata record whose own kind
//! or length is broken is found by its contents. A chunk with a wrong checksum gives no messages: no message is better
//! than a wrong one.

use std::{
    collections::{BTreeMap, VecDeque},
    io::{self, Read},
    sync::Arc,
};

use mcap::{
    McapError,
    read::ChannelAccumulator,
    records::{MessageHeader, Record as McapRecord, op},
};
use tactus_schema::WallTime;

use crate::{
    Completeness,
    channel::standard_channel,
    chunk::{RECORD_MAX_BYTES, Unpacker},
    completeness::DamageNotes,
    header::{Attachment, LIBRARY, METADATA_NAME, RunMetadata},
    layout::{inner_bytes, is_whole},
};

/// At most this much is read at once, so that a wrong length costs no memory.
const READ_BYTES: usize = 64 * 1024;

/// A record's kind and length.
const HEAD_BYTES: usize = 9;

/// After damage, records of kinds without a checksum count only up to this length.
const PLAIN_MAX_BYTES: usize = 1024 * 1024;

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

/// Gives the file's items in order. The checksum of a chunk is compared before anything in it is given.
pub(crate) struct Scan<R> {
    ahead: Ahead<R>,
    unpacker: Unpacker,
    channels: ChannelAccumulator<'static>,
    /// True if this crate wrote the file: then its channels are known without their declarations.
    ours: bool,
    rig: Option<String>,
    undeclared: BTreeMap<u16, Arc<mcap::Channel<'static>>>,
    items: VecDeque<ScanItem>,
    notes: DamageNotes,
    in_summary: bool,
    end: Option<Completeness>,
}

/// A record that can be used.
struct Found {
    opcode: u8,
    /// Where its body is, from the present position.
    body: std::ops::Range<usize>,
}

impl<R: Read> Scan<R> {
    pub(crate) fn new(source: R) -> Self {
        Self {
            ahead: Ahead::new(source),
            unpacker: Unpacker::new(),
            channels: ChannelAccumulator::default(),
            ours: false,
            rig: None,
            undeclared: BTreeMap::new(),
            items: VecDeque::new(),
            notes: DamageNotes::default(),
            in_summary: false,
            end: None,
        }
    }

    /// How much could be read; `None` until the end is reached.
    pub(crate) fn completeness(&self) -> Option<&Completeness> {
        self.end.as_ref()
    }

    /// True once the index at the end was reached: everything before it was read.
    pub(crate) fn in_index(&self) -> bool {
        self.in_summary
    }

    /// Notes that an item that was given proved to be damaged.
    pub(crate) fn condemn(&mut self, reason: String) {
        self.notes.place(self.ahead.at_byte, || reason, false);
    }

    /// The next item; `None` at the end. Errors are the source's own.
    pub(crate) fn next_item(&mut self) -> io::Result<Option<ScanItem>> {
        loop {
            if let Some(item) = self.items.pop_front() {
                return Ok(Some(item));
            }
            if self.end.is_some() {
                return Ok(None);
            }
            if self.ahead.at_byte == 0 {
                self.start_mark()?;
            } else {
                self.record()?;
            }
        }
    }

    fn start_mark(&mut self) -> io::Result<()> {
        if !self.ahead.fill(mcap::MAGIC.len())? {
            self.cut("the file ends within its start mark");
            return Ok(());
        }
        if self.ahead.bytes()[..mcap::MAGIC.len()] != *mcap::MAGIC {
            self.notes.place(0, || "the start mark is wrong".into(), false).bytes += mcap::MAGIC.len() as u64;
        }
        self.ahead.advance(mcap::MAGIC.len());
        Ok(())
    }

    /// Reads the record at the present position, or finds the next one.
    fn record(&mut self) -> io::Result<()> {
        let problem = match self.found_here()? {
            Ok(found) => match self.take(&found)? {
                Ok(()) => return Ok(()),
                Err(problem) => problem,
            },
            Err(problem) => problem,
        };
        self.search(problem)
    }

    /// The record at the present position; the error says what is wrong with it.
    fn found_here(&mut self) -> io::Result<Result<Found, String>> {
        if !self.ahead.fill(HEAD_BYTES)? {
            return Ok(Err("the file ends here, without its end mark".into()));
        }
        let (opcode, length) = self.ahead.head();
        let Some(length) = usize::try_from(length).ok().filter(|length| *length <= RECORD_MAX_BYTES) else {
            return Ok(Err(format!("a record of kind {opcode} is said to be {length} bytes long")));
        };
        if opcode == 0 || (16..128).contains(&opcode) {
            return Ok(Err(format!("there is no record of kind {opcode}")));
        }
        if !self.ahead.fill(HEAD_BYTES + length)? {
            return Ok(Err("the file ends here, within a record".into()));
        }
        let body = HEAD_BYTES..HEAD_BYTES + length;
        if !is_whole(opcode, &self.ahead.bytes()[body.clone()]) {
            return Ok(Err(format!(
                "a record of kind {opcode} is damaged: its lengths contradict each other"
            )));
        }
        Ok(Ok(Found { opcode, body }))
    }

    /// Uses a record and goes on behind it; the error says why it cannot be used.
    fn take(&mut self, found: &Found) -> io::Result<Result<(), String>> {
        let body = &self.ahead.bytes()[found.body.clone()];
        let taken = match found.opcode {
            op::HEADER => {
                self.ours |= contains(body, LIBRARY.as_bytes());
                Ok(())
            }
            op::CHUNK => match self.unpacker.unpack(body) {
                Ok(records) => {
                    for record in records {
                        self.inner(record.opcode, &record.body);
                    }
                    Ok(())
                }
                Err(problem) => Err(problem),
            },
            op::SCHEMA | op::CHANNEL if self.in_summary => Ok(()),
            op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                let body = body.to_vec();
                self.inner(found.opcode, &body);
                Ok(())
            }
            op::METADATA => metadata(body).map(|metadata| {
                if metadata.name == METADATA_NAME {
                    self.rig = RunMetadata::from_record(&metadata).ok().map(|run| run.rig);
                }
                self.items.push_back(ScanItem::Metadata(metadata));
            }),
            op::ATTACHMENT => attachment(body).map(|file| self.items.push_back(ScanItem::Attachment(file))),
            op::DATA_END => {
                self.data_end(found);
                return Ok(Ok(()));
            }
            op::FOOTER => return self.footer(found),
            _ => Ok(()),
        };
        if taken.is_ok() {
            self.ahead.advance(found.body.end);
        }
        Ok(taken)
    }

    /// Uses a record from within a chunk, whose checksum was right. Whatever is wrong with it was written that way.
    fn inner(&mut self, opcode: u8, body: &[u8]) {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return;
        }
        let parsed = if is_whole(opcode, body) {
            self.parsed(opcode, body).map_err(|error| error.to_string())
        } else {
            Err(format!("a record of kind {opcode} is damaged: its lengths contradict each other"))
        };
        match parsed {
            Ok(item) => self.items.extend(item),
            Err(problem) => self.condemn(problem),
        }
    }

    fn parsed(&mut self, opcode: u8, body: &[u8]) -> Result<Option<ScanItem>, McapError> {
        #[expect(clippy::wildcard_enum_match_arm, reason = "the caller picked the kinds that matter")]
        Ok(match mcap::parse_record(opcode, body)? {
            McapRecord::Schema { header, data } => {
                self.channels.add_schema_from_slice(header, &data)?;
                None
            }
            McapRecord::Channel(channel) => {
                self.channels.add_channel(channel)?;
                None
            }
            McapRecord::Message { header, data } => {
                let unknown = McapError::UnknownChannel(header.sequence, header.channel_id);
                let known = self.channels.get(header.channel_id);
                let channel = known.or_else(|| self.undeclared(header.channel_id)).ok_or(unknown)?;
                Some(ScanItem::Message(RawMessage { channel, header, data: data.into_owned() }))
            }
            _ => None,
        })
    }

    /// The channel of a message whose declaration is lost: recordings have the same ones in the same order.
    fn undeclared(&mut self, id: u16) -> Option<Arc<mcap::Channel<'static>>> {
        if let Some(channel) = self.undeclared.get(&id) {
            return Some(Arc::clone(channel));
        }
        let rig = self.rig.as_deref().filter(|_| self.ours && !self.notes.none())?;
        let channel = Arc::new(standard_channel(id, rig)?);
        self.undeclared.insert(id, Arc::clone(&channel));
        Some(channel)
    }

    fn data_end(&mut self, found: &Found) {
        let [.., a, b, c, d] = self.ahead.bytes()[found.body.clone()] else { return };
        let (saved, data) = (u32::from_le_bytes([a, b, c, d]), self.ahead.checksum());
        // Once something is damaged, the checksum says nothing more.
        if self.notes.none() && saved != 0 && saved != data {
            let reason = || "a checksum over everything is wrong, though all messages are right".into();
            self.notes.place(self.ahead.at_byte, reason, false);
        }
        self.ahead.advance(found.body.end);
        self.ahead.restart_checksum();
        self.in_summary = true;
    }

    fn footer(&mut self, found: &Found) -> io::Result<Result<(), String>> {
        let at_byte = self.ahead.at_byte;
        let end = found.body.end;
        let marked = self.ahead.fill(end + mcap::MAGIC.len())?;
        let more = self.ahead.fill(end + mcap::MAGIC.len() + 1)?;
        if more {
            return Ok(Err("the end mark is not at the end".into()));
        }
        let saved = &self.ahead.bytes()[end - 4..end];
        let saved = u32::from_le_bytes([saved[0], saved[1], saved[2], saved[3]]);
        self.ahead.advance(end - 4);
        if self.notes.none() && self.in_summary && saved != 0 && saved != self.ahead.checksum() {
            self.notes.place(at_byte, || "the checksum of the index is wrong".into(), true);
        }
        self.ahead.advance(4);
        let mark = self.ahead.bytes();
        if !marked {
            let at_byte = self.ahead.at_byte;
            self.end = Some(self.notes.cut(at_byte, "the file ends within its end mark".into()));
            return Ok(Ok(()));
        }
        if mark != mcap::MAGIC {
            let bytes = mark.len() as u64;
            self.notes.place(self.ahead.at_byte, || "the end mark is wrong".into(), true).bytes += bytes;
        }
        self.end = Some(self.notes.ended());
        Ok(Ok(()))
    }

    /// True if the file ends there, ahead of the present position, or if a record seems to begin.
    fn goes_on_at(&mut self, end: usize) -> io::Result<bool> {
        if !self.ahead.fill(end + HEAD_BYTES)? {
            return Ok(self.ahead.bytes().len() == end);
        }
        let [opcode, ref length @ ..] = self.ahead.bytes()[end..end + HEAD_BYTES] else { return Ok(false) };
        let length = length.iter().rev().fold(0, |length, byte| length << 8 | u64::from(*byte));
        Ok((op::FOOTER..=op::DATA_END).contains(&opcode) && (1..=RECORD_MAX_BYTES as u64).contains(&length))
    }

    /// Uses the chunk at the present position if just the length of its content is damaged. False if it is not so.
    fn mend_chunk(&mut self) -> io::Result<bool> {
        const SIZE_BYTES: usize = 8;
        if !self.ahead.fill(HEAD_BYTES + 36)?
            || self.ahead.head().0 != op::CHUNK
            || !self.seems_chunk(HEAD_BYTES)?
        {
            return Ok(false);
        }
        let Some(length) =
            usize::try_from(self.ahead.head().1).ok().filter(|length| *length <= RECORD_MAX_BYTES)
        else {
            return Ok(false);
        };
        let name_bytes = usize::from(self.ahead.bytes()[HEAD_BYTES + 28]);
        let content_at = 32 + name_bytes + SIZE_BYTES;
        let Some(content_bytes) = length.checked_sub(content_at) else { return Ok(false) };
        if !self.ahead.fill(HEAD_BYTES + length)? || !self.goes_on_at(HEAD_BYTES + length)? {
            return Ok(false);
        }
        let mut body = self.ahead.bytes()[HEAD_BYTES..HEAD_BYTES + length].to_vec();
        body[content_at - SIZE_BYTES..content_at].copy_from_slice(&(content_bytes as u64).to_le_bytes());
        let checked = body[24..28] != [0; 4];
        let Some(records) = self.unpacker.unpack(&body).ok().filter(|_| checked) else { return Ok(false) };
        let reason = || "a chunk's length is damaged, which the record's own length replaces".to_owned();
        self.notes.place(self.ahead.at_byte, reason, false).bytes += SIZE_BYTES as u64;
        for record in records {
            self.inner(record.opcode, &record.body);
        }
        self.ahead.advance(HEAD_BYTES + length);
        Ok(true)
    }

    /// Finds the next record behind a damaged place, which begins at the present position.
    fn search(&mut self, problem: String) -> io::Result<()> {
        if self.mend_chunk()? {
            return Ok(());
        }
        let from_byte = self.ahead.at_byte;
        if !self.ahead.fill(1)? {
            self.cut(&problem);
            return Ok(());
        }
        let is_chunk = self.ahead.bytes().first() == Some(&op::CHUNK);
        // A record that the file's end cuts off is no damage, unless something follows it after all.
        let reaches_end = !self.ahead.fill(HEAD_BYTES)? || {
            let (_, length) = self.ahead.head();
            let length = usize::try_from(length).ok().filter(|length| *length <= RECORD_MAX_BYTES);
            match length {
                Some(length) => !self.ahead.fill(HEAD_BYTES + length)?,
                None => false,
            }
        };
        let found = loop {
            self.ahead.advance(1);
            if !self.ahead.fill(1)? {
                break None;
            }
            if let Some(found) = self.found_behind_damage()? {
                break Some(found);
            }
        };
        let bytes = self.ahead.at_byte - from_byte;
        if found.is_none() && reaches_end {
            self.end = Some(self.notes.cut(from_byte, problem));
            return Ok(());
        }
        // Of a record that is found without its head, only that is lost.
        let headless = found.as_ref().is_some_and(|found| found.body.start == 0);
        let own_head = headless && bytes == HEAD_BYTES as u64;
        // The index begins behind a record of this length.
        let is_data_end = bytes == HEAD_BYTES as u64 + 4;
        let in_index =
            self.in_summary || found.as_ref().is_some_and(|found| is_of_index(found.opcode)) && is_data_end;
        let damage = self.notes.place(from_byte, || problem, in_index);
        damage.bytes += bytes;
        damage.chunks += u64::from(is_chunk && !own_head);
        match found {
            Some(found) => {
                // It was checked when it was found.
                if let Err(problem) = self.take(&found)? {
                    self.condemn(problem);
                }
            }
            None => self.cut("the file ends here, without its end mark"),
        }
        Ok(())
    }

    /// A record at the present position that can be trusted without knowing where the one before it ends.
    fn found_behind_damage(&mut self) -> io::Result<Option<Found>> {
        let Some((opcode, start)) = self.plausible()? else { return Ok(None) };
        let rest = &self.ahead.bytes()[start..];
        let body = start..start + inner_bytes(opcode, rest).unwrap_or(rest.len());
        let is_right = match opcode {
            op::CHUNK => {
                let checked = rest.get(24..28).is_some_and(|crc| crc != [0; 4]);
                let unpacks = checked && self.unpacker.unpack(&self.ahead.bytes()[body.clone()]).is_ok();
                // Unpacking does not notice if its length is said to be too great.
                unpacks && self.goes_on_at(body.end)?
            }
            op::ATTACHMENT => {
                let body = &self.ahead.bytes()[body.clone()];
                !body.ends_with(&[0; 4]) && attachment(body).is_ok()
            }
            op::METADATA => metadata(&self.ahead.bytes()[body.clone()]).is_ok(),
            op::FOOTER => {
                let rest = self.ahead.bytes().len() - body.end;
                rest == mcap::MAGIC.len() && !self.ahead.fill(body.end + rest + 1)?
            }
            _ => true,
        };
        Ok(is_right.then_some(Found { opcode, body }))
    }

    /// Kind of the record that seems to be at the present position, and where its body begins: behind its kind and length,
    /// or, if these are lost, here. All of it is then in memory.
    fn plausible(&mut self) -> io::Result<Option<(u8, usize)>> {
        if !self.ahead.fill(HEAD_BYTES)? {
            return Ok(None);
        }
        let (opcode, length) = self.ahead.head();
        let longest = match opcode {
            op::CHUNK | op::ATTACHMENT => RECORD_MAX_BYTES,
            op::FOOTER..=op::CHANNEL | op::MESSAGE_INDEX..=op::DATA_END => PLAIN_MAX_BYTES,
            _ => 0,
        };
        if let Some(length) = usize::try_from(length).ok().filter(|length| (1..=longest).contains(length)) {
            let seems = opcode != op::CHUNK || self.seems_chunk(HEAD_BYTES)?;
            let here =
                seems && self.ahead.fill(HEAD_BYTES + length + if opcode == op::FOOTER { 8 } else { 0 })?;
            if here && is_whole(opcode, &self.ahead.bytes()[HEAD_BYTES..HEAD_BYTES + length]) {
                return Ok(Some((opcode, HEAD_BYTES)));
            }
        }
        for (opcode, seems) in [
            (op::CHUNK, self.seems_chunk(0)?),
            (op::METADATA, self.seems_run()?),
            (op::ATTACHMENT, self.seems_attachment()?),
        ] {
            if seems && self.holds_whole(opcode)? {
                return Ok(Some((opcode, 0)));
            }
        }
        Ok(None)
    }

    /// True if the name of a compression is where a chunk's body has it.
    fn seems_chunk(&mut self, body_at: usize) -> io::Result<bool> {
        let here = self.ahead.fill(body_at + 36)?;
        let name = self.ahead.bytes().get(body_at + 28..body_at + 36);
        Ok(here && name.is_some_and(|name| name == b"\x04\0\0\0zstd" || name.starts_with(b"\x03\0\0\0lz4")))
    }

    fn seems_run(&mut self) -> io::Result<bool> {
        let name = METADATA_NAME.as_bytes();
        let here = self.ahead.fill(4 + name.len())?;
        Ok(here
            && self.ahead.bytes()[4..].starts_with(name)
            && usize::from(self.ahead.bytes()[0]) == name.len())
    }

    /// True if a short name in plain letters is where an attachment's body has it.
    fn seems_attachment(&mut self) -> io::Result<bool> {
        if !self.ahead.fill(20)? {
            return Ok(false);
        }
        let [length, 0, 0, 0] = self.ahead.bytes()[16..20] else { return Ok(false) };
        let length = usize::from(length);
        if length == 0 || !self.ahead.fill(20 + length)? {
            return Ok(false);
        }
        Ok(self.ahead.bytes()[20..20 + length].iter().all(u8::is_ascii_graphic))
    }

    /// Reads on until the body at the present position is in memory; false if it never is.
    fn holds_whole(&mut self, opcode: u8) -> io::Result<bool> {
        let mut bytes = self.ahead.bytes().len();
        loop {
            if inner_bytes(opcode, self.ahead.bytes()).is_some() {
                return Ok(true);
            }
            bytes += READ_BYTES;
            if bytes > RECORD_MAX_BYTES || !self.ahead.fill(bytes.min(self.ahead.bytes().len() + 1))? {
                return Ok(false);
            }
        }
    }

    fn cut(&mut self, reason: &str) {
        let at_byte = self.ahead.at_byte;
        self.end = Some(self.notes.cut(at_byte, reason.into()));
    }
}

/// The part of the file from the present position on that is in memory.
struct Ahead<R> {
    source: R,
    buffer: Vec<u8>,
    start: usize,
    /// The present position in the file.
    at_byte: u64,
    ended: bool,
    checksum: crc32fast::Hasher,
}

impl<R: Read> Ahead<R> {
    fn new(source: R) -> Self {
        Self {
            source,
            buffer: Vec::new(),
            start: 0,
            at_byte: 0,
            ended: false,
            checksum: crc32fast::Hasher::new(),
        }
    }

    fn bytes(&self) -> &[u8] {
        &self.buffer[self.start..]
    }

    /// Kind and length of a record at the present position; the caller has filled them in.
    fn head(&self) -> (u8, u64) {
        match *self.bytes() {
            [opcode, a, b, c, d, e, f, g, h, ..] => (opcode, u64::from_le_bytes([a, b, c, d, e, f, g, h])),
            _ => (0, 0),
        }
    }

    /// Reads on until this many bytes are in memory; false if the file ends before.
    fn fill(&mut self, bytes: usize) -> io::Result<bool> {
        while self.bytes().len() < bytes {
            if self.ended {
                return Ok(false);
            }
            if self.start > READ_BYTES && self.start > self.bytes().len() {
                self.buffer.drain(..self.start);
                self.start = 0;
            }
            let end = self.buffer.len();
            self.buffer.resize(end + READ_BYTES, 0);
            let read = loop {
                match self.source.read(&mut self.buffer[end..]) {
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    read => break read,
                }
            };
            self.buffer.truncate(end + *read.as_ref().unwrap_or(&0));
            self.ended = read? == 0;
        }
        Ok(true)
    }

    fn advance(&mut self, bytes: usize) {
        self.checksum.update(&self.buffer[self.start..self.start + bytes]);
        self.start += bytes;
        self.at_byte += bytes as u64;
    }

    /// The checksum of everything since it was restarted.
    fn checksum(&self) -> u32 {
        self.checksum.clone().finalize()
    }

    fn restart_checksum(&mut self) {
        self.checksum = crc32fast::Hasher::new();
    }
}

fn metadata(body: &[u8]) -> Result<mcap::records::Metadata, String> {
    match mcap::parse_record(op::METADATA, body) {
        Ok(McapRecord::Metadata(metadata)) if RunMetadata::checked(&metadata) => Ok(metadata),
        Ok(McapRecord::Metadata(metadata)) => {
            Err(format!("metadata {}: its checksum is wrong", metadata.name))
        }
        Ok(_) => Err("no metadata".into()),
        Err(error) => Err(error.to_string()),
    }
}

fn attachment(body: &[u8]) -> Result<Attachment, String> {
    match mcap::parse_record(op::ATTACHMENT, body) {
        // Its checksum was compared.
        Ok(McapRecord::Attachment { header, data, .. }) => Ok(Attachment {
            name: header.name,
            media_type: header.media_type,
            written: WallTime::from_ns(i64::try_from(header.log_time).unwrap_or(i64::MAX)),
            data: data.into_owned(),
        }),
        Ok(_) => Err("no attachment".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// True for the kinds of records that only the index at the end of a recording has outside of chunks.
fn is_of_index(opcode: u8) -> bool {
    matches!(
        opcode,
        op::SCHEMA
            | op::CHANNEL
            | op::STATISTICS
            | op::CHUNK_INDEX
            | op::ATTACHMENT_INDEX
            | op::METADATA_INDEX
            | op::SUMMARY_OFFSET
            | op::FOOTER
    )
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}
