//! Makes a complete recording from a damaged one.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::Write,
    path::Path,
    sync::Arc,
};

use mcap::McapError;
use tactus_schema::{
    DESCRIPTOR_SET, TimeStamp,
    key::Keys,
    pb::{self, run_event::Event},
};

use crate::{
    Completeness, Info, Message, MessageKind, RecordError, RunMetadata, Tally,
    channel::{PROTOBUF, unsigned, wrapped, writer},
    header::METADATA_NAME,
    info,
    reader::{decode, io_error},
    scan::{RawMessage, Scan, ScanItem},
};

/// The result of a recovery.
#[derive(Debug, Clone)]
pub struct Recovery {
    /// How much of the damaged file could be read.
    pub damage: Completeness,
    /// Number of messages copied.
    pub messages: u64,
    /// True if the run was open and is now closed as crashed.
    pub closed: bool,
    /// The new recording, read back from disk.
    pub info: Info,
}

/// Copies the readable part of the recording at `path` to `out`, and closes its run as crashed if it was open.
///
/// Metadata, attachments and messages are copied byte for byte, with their times. The output is read back and compared
/// before this returns. `out` must not exist beforehand, and does not exist after an error.
///
/// # Errors
/// If `path` cannot be read or is no recording, if nothing is wrong with it, or if `out` cannot be written or does
/// not read back.
pub fn recover(path: impl AsRef<Path>, out: impl AsRef<Path>) -> Result<Recovery, RecordError> {
    let (path, out) = (path.as_ref(), out.as_ref());
    let before = info(path)?;
    if before.completeness == Completeness::Complete && before.exit_status.is_some() {
        return Err(RecordError::NothingToRecover { path: path.to_owned() });
    }
    let file = OpenOptions::new().write(true).create_new(true).open(out);
    let file = file.map_err(|source| RecordError::Io { action: "create", path: out.to_owned(), source })?;
    let made = rewrite(path, out, file).and_then(|copy| verify(out, before, copy));
    if made.is_err() {
        // An error of the removal would hide the one that matters.
        drop(fs::remove_file(out));
    }
    made
}

#[derive(Clone, Copy)]
struct CopyCounts {
    messages: u64,
    closed: bool,
}

fn rewrite(path: &Path, out: &Path, file: File) -> Result<CopyCounts, RecordError> {
    let unwritten = |source| RecordError::Write { path: out.to_owned(), source };
    let source = File::open(path).map_err(|source| io_error(path, source))?;
    let mut scan = Scan::new(std::io::BufReader::new(source));
    let mut copy = RecordingCopy::new(file).map_err(unwritten)?;
    while let Some(item) = scan.next_item().map_err(|source| io_error(path, source))? {
        match item {
            ScanItem::Message(raw) => match decode(&raw) {
                Ok(message) => copy.message(raw, &message).map_err(unwritten)?,
                Err(_) => break,
            },
            ScanItem::Metadata(record) => copy.metadata(&record).map_err(unwritten)?,
            ScanItem::Attachment(file) => copy
                .mcap
                .attach(&mcap::Attachment {
                    log_time: unsigned(file.written.ns()),
                    create_time: unsigned(file.written.ns()),
                    name: file.name,
                    media_type: file.media_type,
                    data: file.data.into(),
                })
                .map_err(unwritten)?,
        }
    }
    let closed = copy.close_run().map_err(unwritten)?;
    let messages = copy.messages;
    let file = copy.finish().map_err(unwritten)?;
    file.sync_all().map_err(|source| RecordError::Io { action: "sync", path: out.to_owned(), source })?;
    Ok(CopyCounts { messages, closed })
}

fn verify(out: &Path, before: Info, copied: CopyCounts) -> Result<Recovery, RecordError> {
    let after = info(out)?;
    let problem = |problem: String| RecordError::Unverified { path: out.to_owned(), problem };
    if let Completeness::Truncated { at_byte, reason } = &after.completeness {
        return Err(problem(format!("at byte {at_byte}: {reason}")));
    }
    let messages: u64 = after.topics.values().sum();
    let meant = copied.messages + u64::from(copied.closed);
    if messages != meant || after.frames != before.frames || after.attachments != before.attachments {
        return Err(problem(format!("{messages} messages stand where {meant} were written")));
    }
    Ok(Recovery {
        damage: before.completeness,
        messages: copied.messages,
        closed: copied.closed,
        info: after,
    })
}

/// The recording being written.
struct RecordingCopy<W: Write> {
    mcap: mcap::Writer<mcap::write::NoSeek<std::io::BufWriter<W>>>,
    messages: u64,
    tally: Tally,
    run: Option<RunMetadata>,
    last_event: Option<u64>,
    last_time: TimeStamp,
}

impl<W: Write> RecordingCopy<W> {
    fn new(sink: W) -> Result<Self, McapError> {
        Ok(Self {
            mcap: writer(sink)?,
            messages: 0,
            tally: Tally::default(),
            run: None,
            last_event: None,
            last_time: TimeStamp::default(),
        })
    }

    fn metadata(&mut self, record: &mcap::records::Metadata) -> Result<(), McapError> {
        if record.name == METADATA_NAME {
            self.run = RunMetadata::from_record(record).ok();
        }
        self.mcap.write_metadata(record)
    }

    fn message(&mut self, raw: RawMessage, message: &Message) -> Result<(), McapError> {
        self.messages += 1;
        self.tally.take(message);
        self.last_time = message.at().unwrap_or(self.last_time);
        if let Message::Event(event) = message {
            self.last_event = Some(event.seq);
        }
        self.mcap.write(&mcap::Message {
            channel: Arc::clone(&raw.channel),
            sequence: raw.header.sequence,
            log_time: raw.header.log_time,
            publish_time: raw.header.publish_time,
            data: raw.data.into(),
        })
    }

    /// Adds the event that the run crashed, unless the run has ended; true if it was added.
    fn close_run(&mut self) -> Result<bool, McapError> {
        let Some(run) = self.run.as_ref().filter(|_| self.tally.finished().is_none()) else {
            return Ok(false);
        };
        let (t_mono_ns, t_wall_ns) = (self.last_time.mono.ns(), self.last_time.wall.ns());
        let event = pb::RunEvent {
            seq: self.last_event.map_or(0, |seq| seq + 1),
            run_id: run.run_id.clone(),
            t_mono_ns,
            t_wall_ns,
            event: Some(Event::Finished(pb::RunFinished {
                exit_status: pb::ExitStatus::Crashed.into(),
                message: "the service died during the run; the recording was recovered".into(),
                frames: self.tally.frames(),
                frames_lost: self.tally.frames_lost(),
                presses: self.tally.presses(),
                dwells: self.tally.dwells(),
                duration_s: self.tally.duration().as_secs_f64(),
            })),
        };
        let kind = MessageKind::Event;
        let schema = self.mcap.add_schema(kind.schema(), PROTOBUF, DESCRIPTOR_SET)?;
        let topic = Keys::new(run.rig.clone()).topic(kind.topic());
        let channel_id = self.mcap.add_channel(schema, &topic, PROTOBUF, &BTreeMap::new())?;
        let log_time = unsigned(t_wall_ns);
        let sequence = wrapped(event.seq);
        let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.mcap.write_to_known_channel(&header, &prost::Message::encode_to_vec(&event))?;
        Ok(true)
    }

    fn finish(mut self) -> Result<W, McapError> {
        self.mcap.finish()?;
        self.mcap.into_inner().into_inner().into_inner().map_err(|error| McapError::Io(error.into_error()))
    }
}
