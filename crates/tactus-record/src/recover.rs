//! Makes a complete recording from a damaged one.

use std::{
    collections::BTreeMap,
    fmt,
    fs::{self, File, OpenOptions},
    io::{BufReader, BufWriter, Write},
    path::Path,
    sync::Arc,
};

use mcap::{McapError, records::MessageHeader, write::NoSeek};
use tactus_schema::{
    Rig, TimeStamp, WallTime,
    key::Keys,
    pb::{self, run_event::Event},
};

use crate::{
    Attachment, Completeness, Info, Message, MessageKind, RecordError, RunMetadata, Tally,
    channel::{ChannelIds, declare, unsigned, wrapped, writer},
    confirmed::Confirmed,
    header::{METADATA_NAME, RIG_JSON, RIG_TOML},
    info, meter,
    meter::MeteredFile,
    reader::{decode, first_bytes, io_error, is_mcap},
    scan::{RawMessage, Scan, ScanItem},
    storage::sync_folder_of,
};

/// The result of a recovery.
#[derive(Debug, Clone)]
pub struct Recovery {
    /// How much of the damaged file could be read.
    pub damage: Completeness,
    /// True if something that was written may be missing: bytes within the recording could not be read.
    pub is_lossy: bool,
    /// Number of messages copied.
    pub messages: u64,
    /// Number of frames that were received and are missing, as far as the numbers of the others tell.
    pub frames_missing: u64,
    /// True if the run was open and is now closed: as crashed, or, if the part that said how it ended is damaged, as failed.
    pub closed: bool,
    /// What the damaged file lacks besides messages, and was made from the rest.
    pub rebuilt: Vec<&'static str>,
    /// The last press that was done to its end.
    pub last_press: Option<LastPress>,
    /// The tip as the stage last reported it, robot frame: depth is -z.
    pub tip_mm: Option<[f64; 3]>,
    /// The new recording, read back from disk.
    pub info: Info,
}

/// A press, for messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastPress {
    /// Index of the press in the run.
    pub press: i32,
    /// Where it was, sensor frame.
    pub at_mm: [f64; 2],
    /// Depth of its last dwell.
    pub depth_mm: f64,
}

impl fmt::Display for LastPress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { press, at_mm: [x_mm, y_mm], depth_mm } = self;
        write!(f, "press {press} at ({x_mm:.3}, {y_mm:.3}) mm, {depth_mm:.3} mm deep")
    }
}

/// Copies everything intact of the recording at `path` to `out`, and closes its run if it was open.
///
/// Attachments and messages are copied byte for byte, with their times. The output is read back and compared before this
/// returns, and is durable then. `out` must not exist beforehand, and does not exist after an error.
///
/// # Errors
/// If `path` cannot be read or is no recording, if nothing is wrong with it, or if `out` cannot be written or does
/// not read back.
pub fn recover(path: impl AsRef<Path>, out: impl AsRef<Path>) -> Result<Recovery, RecordError> {
    let (path, out) = (path.as_ref(), out.as_ref());
    // To see what is intact, to copy it, and to read the copy again.
    meter::will_read(path, &[1.0, 1.0, 1.0]);
    let survey = Survey::of(path)?;
    if survey.completeness == Completeness::Complete && survey.tally.finished().is_some() {
        return Err(RecordError::NothingToRecover { path: path.to_owned() });
    }
    let file = OpenOptions::new().write(true).create_new(true).open(out);
    let file = file.map_err(|source| RecordError::Io { action: "create", path: out.to_owned(), source })?;
    let made = rewrite(path, out, file, &survey).and_then(|copied| verify(out, survey, copied));
    if made.is_err() {
        // An error of the removal would hide the one that matters.
        drop(fs::remove_file(out));
    }
    made
}

/// What is intact in a recording.
struct Survey {
    run: RunMetadata,
    /// The run's metadata as they were recorded.
    metadata: Option<mcap::records::Metadata>,
    attachments: Vec<Attachment>,
    messages: u64,
    tally: Tally,
    confirmed: Confirmed,
    last_event: Option<u64>,
    last_time: TimeStamp,
    tip_mm: Option<[f64; 3]>,
    completeness: Completeness,
    is_lossy: bool,
}

impl Survey {
    fn of(path: &Path) -> Result<Self, RecordError> {
        if !is_mcap(&first_bytes(path)?) {
            return Err(RecordError::NotMcap { path: path.to_owned() });
        }
        let unread = |source| io_error(path, source);
        let file = File::open(path).map_err(unread)?;
        let bytes = file.metadata().map_err(unread)?.len();
        let mut scan = Scan::new(BufReader::new(MeteredFile(file)));
        let mut found = Found::default();
        while let Some(item) = scan.next_item().map_err(unread)? {
            found.take(item);
        }
        let completeness = scan.completeness().cloned().unwrap_or(Completeness::Complete);
        let only_index_cut = scan.in_index() && matches!(completeness, Completeness::Truncated { .. });
        let (metadata, recorded) = found.metadata.unzip();
        let run = recorded.or(found.told).ok_or_else(|| RecordError::NoRun { path: path.to_owned() })?;
        Ok(Self {
            run,
            metadata,
            attachments: found.attachments,
            messages: found.messages,
            tally: found.tally,
            confirmed: found.confirmed,
            last_event: found.last_event,
            last_time: found.last_time,
            tip_mm: found.tip_mm,
            is_lossy: completeness.is_lossy(bytes) && !only_index_cut,
            completeness,
        })
    }

    /// `rig.json`, made from the rig file, if only that is left.
    fn rebuilt_rig(&self) -> Option<Attachment> {
        let text = |name: &str| self.attachments.iter().find(|file| file.name == name);
        if text(RIG_JSON).is_some() {
            return None;
        }
        let file = text(RIG_TOML)?;
        let rig = Rig::from_toml(std::str::from_utf8(&file.data).ok()?).ok()?;
        let data = rig.to_json().into_bytes();
        Some(Attachment {
            name: RIG_JSON.into(),
            media_type: "application/json".into(),
            data,
            ..file.clone()
        })
    }

    /// The event that closes the run, unless the run has ended.
    fn closing(&self) -> Option<pb::RunEvent> {
        if self.tally.finished().is_some() {
            return None;
        }
        let (lost_chunks, ended) = match &self.completeness {
            Completeness::Damaged(damage) => (damage.chunks, damage.cut_at_byte.is_none()),
            Completeness::Complete | Completeness::Truncated { .. } => (0, false),
        };
        let (exit_status, message) = if ended && lost_chunks > 0 {
            let message = "how the run ended is not known: that part of the recording is damaged".to_owned();
            (pb::ExitStatus::Failed, message)
        } else {
            (pb::ExitStatus::Crashed, self.crash_in_words())
        };
        // A step in the numbers tells that events may be lost.
        let step = if lost_chunks > 0 { 2 } else { 1 };
        Some(pb::RunEvent {
            seq: self.last_event.map_or(0, |seq| seq.saturating_add(step)),
            run_id: self.run.run_id.clone(),
            t_mono_ns: self.last_time.mono.ns(),
            t_wall_ns: self.last_time.wall.ns(),
            event: Some(Event::Finished(self.tally.finish(exit_status, message))),
        })
    }

    fn crash_in_words(&self) -> String {
        let press = self
            .last_press()
            .map_or("no press was confirmed".into(), |press| format!("last confirmed: {press}"));
        let tip = match self.tip_mm {
            Some([.., z_mm]) => format!("the stage last reported the tip at z = {z_mm:.3} mm"),
            None => "the stage reported no position".into(),
        };
        format!("the service died during the run; the recording was recovered; {press}; {tip}")
    }

    fn last_press(&self) -> Option<LastPress> {
        let press = self.confirmed.last()?;
        let dwell = press.dwells.last()?;
        Some(LastPress { press: press.press, at_mm: [dwell.x_mm, dwell.y_mm], depth_mm: dwell.depth_mm })
    }
}

/// Collects what a [`Survey`] needs.
#[derive(Default)]
struct Found {
    metadata: Option<(mcap::records::Metadata, RunMetadata)>,
    /// The same from the event that the run started.
    told: Option<RunMetadata>,
    attachments: Vec<Attachment>,
    messages: u64,
    tally: Tally,
    confirmed: Confirmed,
    last_event: Option<u64>,
    last_time: TimeStamp,
    tip_mm: Option<[f64; 3]>,
}

impl Found {
    fn take(&mut self, item: ScanItem) {
        match item {
            ScanItem::Metadata(record) if record.name == METADATA_NAME => {
                if let Ok(run) = RunMetadata::from_record(&record) {
                    self.metadata = Some((record, run));
                }
            }
            ScanItem::Metadata(_) => {}
            ScanItem::Attachment(file) => self.attachments.push(file),
            ScanItem::Message(raw) => {
                if let Ok(message) = decode(&raw) {
                    self.message(&message);
                }
            }
        }
    }

    fn message(&mut self, message: &Message) {
        self.messages += 1;
        self.tally.take(message);
        self.last_time = message.at().unwrap_or(self.last_time);
        match message {
            Message::Event(event) => {
                self.last_event = Some(event.seq);
                self.confirmed.take(event);
                if let Some(Event::Started(started)) = &event.event {
                    self.told = Some(RunMetadata {
                        run_id: event.run_id.clone(),
                        experiment: started.experiment.clone(),
                        who: started.who.clone(),
                        rig: started.rig.clone(),
                        script: format!("{}.star", started.experiment),
                        simulated: started.simulated,
                        started: WallTime::from_ns(event.t_wall_ns),
                        continues: started.taken_over.as_ref().map(|taken| taken.run_id.clone()),
                    });
                }
            }
            Message::Stage(state) if state.status() != pb::StageStatus::Disconnected => {
                self.tip_mm = Some([state.x_mm, state.y_mm, state.z_mm]);
            }
            Message::Stage(_)
            | Message::Frame(_)
            | Message::SensorInfo(_)
            | Message::Safety(_)
            | Message::Unknown(_) => {}
        }
    }
}

/// What was written into the new recording.
struct Copied {
    messages: u64,
    closed: bool,
    rebuilt: Vec<&'static str>,
    attachments: usize,
}

fn rewrite(path: &Path, out: &Path, file: File, survey: &Survey) -> Result<Copied, RecordError> {
    let unwritten = |source| RecordError::Write { path: out.to_owned(), source };
    let source = File::open(path).map_err(|source| io_error(path, source))?;
    let mut scan = Scan::new(BufReader::new(MeteredFile(source)));
    let mut copy = RecordingCopy::new(file, survey).map_err(unwritten)?;
    while let Some(item) = scan.next_item().map_err(|source| io_error(path, source))? {
        match item {
            ScanItem::Message(raw) => copy.message(&raw),
            ScanItem::Metadata(record) => copy.metadata(&record),
            ScanItem::Attachment(file) => copy.attachment(file),
        }
        .map_err(unwritten)?;
    }
    let closed = copy.close_run(survey).map_err(unwritten)?;
    let RecordingCopy { messages, rebuilt, attachments, .. } = copy;
    let mut mcap = copy.mcap;
    let synced = mcap.finish().and_then(|_| {
        let buffered = mcap.into_inner().into_inner();
        Ok(buffered.into_inner().map_err(std::io::IntoInnerError::into_error)?)
    });
    let synced = synced.map_err(unwritten)?.sync_all().and_then(|()| sync_folder_of(out));
    synced.map_err(|source| RecordError::Io { action: "sync", path: out.to_owned(), source })?;
    Ok(Copied { messages, closed, rebuilt, attachments })
}

fn verify(out: &Path, survey: Survey, copied: Copied) -> Result<Recovery, RecordError> {
    let after = info(out)?;
    let problem = |problem: String| RecordError::Unverified { path: out.to_owned(), problem };
    if after.completeness != Completeness::Complete {
        return Err(problem(after.completeness.to_string()));
    }
    let messages: u64 = after.topics.values().sum();
    let meant = copied.messages + u64::from(copied.closed);
    if messages != meant || copied.messages != survey.messages {
        return Err(problem(format!("{messages} messages stand where {meant} were written")));
    }
    if after.frames != survey.tally.frames() || after.attachments.len() != copied.attachments {
        return Err(problem("frames or attachments are missing".into()));
    }
    Ok(Recovery {
        last_press: survey.last_press(),
        tip_mm: survey.tip_mm,
        damage: survey.completeness,
        is_lossy: survey.is_lossy,
        messages: copied.messages,
        frames_missing: after.frames_missing,
        closed: copied.closed,
        rebuilt: copied.rebuilt,
        info: after,
    })
}

/// The recording being written.
struct RecordingCopy<W: Write> {
    mcap: mcap::Writer<NoSeek<BufWriter<W>>>,
    ids: ChannelIds,
    /// New channels by old ones.
    channels: BTreeMap<u16, u16>,
    messages: u64,
    rebuilt: Vec<&'static str>,
    attachments: usize,
}

impl<W: Write> RecordingCopy<W> {
    fn new(sink: W, survey: &Survey) -> Result<Self, McapError> {
        let mut mcap = writer(sink)?;
        let ids = declare(&mut mcap, &Keys::new(survey.run.rig.clone()))?;
        let mut copy =
            Self { mcap, ids, channels: BTreeMap::new(), messages: 0, rebuilt: Vec::new(), attachments: 0 };
        if let Some(record) = &survey.metadata {
            copy.mcap.write_metadata(record)?;
        } else {
            copy.mcap.write_metadata(&survey.run.to_record())?;
            copy.rebuilt.push("the run's metadata");
        }
        if let Some(rig) = survey.rebuilt_rig() {
            copy.attachment(rig)?;
            copy.rebuilt.push(RIG_JSON);
        }
        Ok(copy)
    }

    /// Copies metadata. Those of the run were written first.
    fn metadata(&mut self, record: &mcap::records::Metadata) -> Result<(), McapError> {
        if record.name == METADATA_NAME { Ok(()) } else { self.mcap.write_metadata(record) }
    }

    fn attachment(&mut self, file: Attachment) -> Result<(), McapError> {
        self.attachments += 1;
        self.mcap.attach(&mcap::Attachment {
            log_time: unsigned(file.written.ns()),
            create_time: unsigned(file.written.ns()),
            name: file.name,
            media_type: file.media_type,
            data: file.data.into(),
        })
    }

    /// Copies a message that can be read.
    fn message(&mut self, raw: &RawMessage) -> Result<(), McapError> {
        if decode(raw).is_err() {
            return Ok(());
        }
        self.messages += 1;
        let channel_id = if let Some(id) = self.channels.get(&raw.channel.id) {
            *id
        } else {
            let id = self.channel(&raw.channel)?;
            self.channels.insert(raw.channel.id, id);
            id
        };
        self.mcap.write_to_known_channel(&MessageHeader { channel_id, ..raw.header }, &raw.data)
    }

    fn channel(&mut self, old: &Arc<mcap::Channel<'static>>) -> Result<u16, McapError> {
        let schema = old.schema.as_ref();
        let kind = MessageKind::ALL.into_iter().zip(self.ids).find(|(kind, _)| {
            schema.is_some_and(|schema| schema.name == kind.schema())
                && old.topic.ends_with(kind.topic().suffix())
        });
        if let Some((_, id)) = kind {
            return Ok(id);
        }
        let schema = match schema {
            Some(schema) => self.mcap.add_schema(&schema.name, &schema.encoding, &schema.data)?,
            None => 0,
        };
        self.mcap.add_channel(schema, &old.topic, &old.message_encoding, &old.metadata)
    }

    /// Adds the event that ends the run, unless the run has ended; true if it was added.
    fn close_run(&mut self, survey: &Survey) -> Result<bool, McapError> {
        let Some(event) = survey.closing() else { return Ok(false) };
        let log_time = unsigned(event.t_wall_ns);
        let header = MessageHeader {
            channel_id: self.ids[MessageKind::Event as usize],
            sequence: wrapped(event.seq),
            log_time,
            publish_time: log_time,
        };
        self.mcap.write_to_known_channel(&header, &prost::Message::encode_to_vec(&event))?;
        Ok(true)
    }
}
