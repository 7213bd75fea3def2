//! Reads a recording as a stream.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufReader, Read},
    path::{Path, PathBuf},
    sync::Arc,
};

use tactus_schema::WallTime;

use crate::{
    Completeness, Message, RecordError,
    header::{Attachment, METADATA_NAME, RunMetadata},
    meter::MeteredFile,
    scan::{RawMessage, Scan, ScanItem},
};

/// One entry of a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// The run's metadata, the first entry.
    Run(RunMetadata),
    /// An attached file; before all messages.
    Attachment(Attachment),
    /// A message, in the order in which it was recorded.
    Message {
        /// The channel's topic.
        topic: Arc<str>,
        /// When it was recorded, by the host's wall clock.
        at: WallTime,
        /// The decoded message.
        message: Message,
    },
}

/// Gives a recording's entries in order, around whatever is damaged. It never holds more than one chunk in memory.
///
/// The iterator gives an error only if the file system does. At the end, [`Reader::completeness`] says what was damaged.
pub struct Reader<R = BufReader<MeteredFile>> {
    scan: Scan<R>,
    topics: BTreeMap<u16, Arc<str>>,
}

/// Opens a recording.
///
/// # Errors
/// If the file cannot be read or does not begin as an MCAP file.
pub fn read(path: impl AsRef<Path>) -> Result<Reader, RecordError> {
    let path = path.as_ref();
    if !is_mcap(&first_bytes(path)?) {
        return Err(RecordError::NotMcap { path: path.to_owned() });
    }
    Ok(Reader::new(BufReader::with_capacity(64 * 1024, MeteredFile(open(path)?))))
}

/// Opens a recording and reads up to the run's metadata.
pub(crate) fn read_run(path: &Path) -> Result<(RunMetadata, Reader), RecordError> {
    let mut reader = read(path)?;
    for entry in reader.by_ref() {
        match entry.map_err(|source| io_error(path, source))? {
            Entry::Run(run) => return Ok((run, reader)),
            Entry::Attachment(_) => {}
            Entry::Message { .. } => break,
        }
    }
    Err(RecordError::NoRun { path: path.to_owned() })
}

/// The first bytes, as many as MCAP's magic has or fewer in a shorter file; they distinguish kinds of files.
pub(crate) fn first_bytes(path: &Path) -> Result<Vec<u8>, RecordError> {
    let mut start = Vec::new();
    let mut bytes = open(path)?.take(mcap::MAGIC.len() as u64);
    bytes.read_to_end(&mut start).map_err(|source| io_error(path, source))?;
    Ok(start)
}

/// True if the first bytes are MCAP's. One of them may be damaged.
pub(crate) fn is_mcap(first: &[u8]) -> bool {
    first.len() == mcap::MAGIC.len()
        && first.iter().zip(mcap::MAGIC).filter(|(byte, magic)| byte != magic).count() <= 1
}

fn open(path: &Path) -> Result<File, RecordError> {
    File::open(path).map_err(|source| RecordError::Io { action: "open", path: path.to_owned(), source })
}

pub(crate) fn io_error(path: &Path, source: io::Error) -> RecordError {
    RecordError::Io { action: "read", path: PathBuf::from(path), source }
}

impl<R: Read> Reader<R> {
    /// Reads a recording from any source of bytes.
    pub fn new(source: R) -> Self {
        Self { scan: Scan::new(source), topics: BTreeMap::new() }
    }

    /// How much could be read; `None` until the last entry was given.
    pub fn completeness(&self) -> Option<&Completeness> {
        self.scan.completeness()
    }

    fn next_entry(&mut self) -> io::Result<Option<Entry>> {
        while let Some(item) = self.scan.next_item()? {
            let entry = match item {
                ScanItem::Metadata(record) if record.name == METADATA_NAME => {
                    RunMetadata::from_record(&record)
                        .map(Entry::Run)
                        .map_err(|field| format!("metadata {METADATA_NAME}: {field} is missing or wrong"))
                }
                ScanItem::Metadata(_) => continue,
                ScanItem::Attachment(attachment) => Ok(Entry::Attachment(attachment)),
                ScanItem::Message(raw) => decode(&raw)
                    .map(|message| Entry::Message {
                        topic: self.topic(&raw),
                        at: WallTime::from_ns(i64::try_from(raw.header.log_time).unwrap_or(i64::MAX)),
                        message,
                    })
                    .map_err(|error| {
                        format!("message {} on {}: {error}", raw.header.sequence, raw.channel.topic)
                    }),
            };
            match entry {
                Ok(entry) => return Ok(Some(entry)),
                Err(reason) => self.scan.condemn(reason),
            }
        }
        Ok(None)
    }

    /// Messages on one channel share the text of its topic.
    fn topic(&mut self, raw: &RawMessage) -> Arc<str> {
        let shared = self.topics.entry(raw.header.channel_id);
        Arc::clone(shared.or_insert_with(|| Arc::from(raw.channel.topic.as_str())))
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = io::Result<Entry>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_entry().transpose()
    }
}

impl<R> std::fmt::Debug for Reader<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reader").finish_non_exhaustive()
    }
}

pub(crate) fn decode(raw: &RawMessage) -> Result<Message, prost::DecodeError> {
    let schema = raw.channel.schema.as_ref().map_or("", |schema| schema.name.as_str());
    Message::decode(schema, &raw.data)
}
