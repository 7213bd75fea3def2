//! A recording for stock MCAP viewers such as Foxglove: the array as a grid and an image, the stage and the sensor as transforms, the
//! events as a log, all in the viewers' own schemas.
//!
//! It is a file of its own: a recording keeps what was measured, once.

mod scene;
mod schemas;

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
};

use mcap::records::MessageHeader;
use tactus_record::{Entry, Message, Timeline, meter, read};
use tactus_schema::{
    Frame, Rig, WallTime,
    pb::{self, run_event::Event},
};

use crate::run::{ReportError, log::in_words};
pub use scene::{Channel, ENCODING, Level, SCHEMAS, Scene, log_line, rig_in_words};

/// What was written.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ViewerFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Number of frames in it.
    pub frames: u64,
    /// Number of reports of the stage.
    pub positions: u64,
    /// Number of lines of the log.
    pub lines: u64,
}

/// Writes a recording, complete or damaged, for stock viewers.
///
/// # Errors
/// If the recording cannot be read, or the file cannot be written.
pub fn viewer_file(recording: &Path, out: impl Into<PathBuf>) -> Result<ViewerFile, ReportError> {
    let out = out.into();
    // For the motion of the stage, for the greatest rise, then for all messages.
    meter::will_read(recording, &[1.0, 1.0, 4.0]);
    let timeline = Timeline::read(recording)?;
    let part = with_suffix(&out, ".part");
    let written = write(recording, &timeline, &part);
    let failed = |source| ReportError::Io { path: out.clone(), source };
    match written.and_then(|written| fs::rename(&part, &out).map(|()| written).map_err(failed)) {
        Ok(Written { frames, positions, lines }) => Ok(ViewerFile { path: out, frames, positions, lines }),
        Err(error) => {
            // An error of the removal would hide the one that matters.
            drop(fs::remove_file(&part));
            Err(error)
        }
    }
}

#[derive(Default)]
struct Written {
    frames: u64,
    positions: u64,
    lines: u64,
}

fn write(recording: &Path, timeline: &Timeline, part: &Path) -> Result<Written, ReportError> {
    let io_failed = |source| ReportError::Io { path: part.to_owned(), source };
    let failed = |error: mcap::McapError| io_failed(io::Error::other(error));
    let read_failed = |source| ReportError::Io { path: recording.to_owned(), source };
    let rig = timeline.rig();
    let greatest_counts = greatest_rise(recording, timeline)?;
    let mut viewer = Viewer::create(part, rig).map_err(failed)?;
    let mut zero = Zero::of(rig);
    let (mut written, mut is_placed) = (Written::default(), false);
    for entry in read(recording)? {
        let Entry::Message { message, at, .. } = entry.map_err(read_failed)? else { continue };
        if !is_placed {
            viewer.put(Channel::Sensor, &viewer.scene.sensor(at), at).map_err(failed)?;
            viewer.log(Level::Info, "rig", &rig_in_words(&rig.name, rig.simulated), at).map_err(failed)?;
            written.lines += 1;
            is_placed = true;
        }
        #[expect(clippy::wildcard_enum_match_arm, reason = "other kinds have no picture")]
        match message {
            Message::Frame(frame) => {
                viewer.frame(&zero.rises(&frame), greatest_counts, at).map_err(failed)?;
                written.frames += 1;
            }
            Message::Stage(state) => {
                if let Some(tip) = viewer.scene.tip(&state, at) {
                    viewer.put(Channel::Tip, &tip, at).map_err(failed)?;
                    written.positions += 1;
                }
            }
            Message::Event(event) => {
                zero.take(&event);
                let (kind, detail) = in_words(&event);
                // Where the tip is, the transforms say.
                if !matches!(kind, "phase" | "step done") {
                    viewer.log(level_of(&event), kind, &detail, at).map_err(failed)?;
                    written.lines += 1;
                }
            }
            Message::Safety(event) => {
                let level =
                    if event.verdict() == pb::SafetyVerdict::Clear { Level::Info } else { Level::Error };
                viewer.log(level, &event.rule, &event.detail, at).map_err(failed)?;
                written.lines += 1;
            }
            _ => {}
        }
    }
    viewer.mcap.finish().map_err(failed)?;
    let file = viewer.mcap.into_inner().into_inner().map_err(|error| io_failed(error.into_error()))?;
    file.sync_all().map_err(io_failed)?;
    Ok(written)
}

/// The reading that counts as no load: the last reference or tare, before them the rig's baseline.
struct Zero(Vec<f32>);

impl Zero {
    fn of(rig: &Rig) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "counts are far within f32")]
        let counts = rig.baseline_counts.iter().map(|counts| *counts as f32).collect();
        Self(counts)
    }

    fn take(&mut self, event: &pb::RunEvent) {
        let counts = match &event.event {
            Some(Event::ReferenceDone(reference)) => &reference.mean_counts,
            Some(Event::TareDone(tare)) => &tare.baseline_counts,
            _ => return,
        };
        if counts.len() == self.0.len() {
            self.0.clone_from(counts);
        }
    }

    fn rises(&self, frame: &Frame) -> Vec<f32> {
        frame.counts.iter().zip(&self.0).map(|(counts, zero)| counts - zero).collect()
    }
}

/// The greatest rise of any element in the run, at least 1: white in the image.
fn greatest_rise(recording: &Path, timeline: &Timeline) -> Result<f32, ReportError> {
    let mut zero = Zero::of(timeline.rig());
    let mut greatest = 1.0_f32;
    for entry in read(recording)? {
        match entry.map_err(|source| ReportError::Io { path: recording.to_owned(), source })? {
            Entry::Message { message: Message::Event(event), .. } => zero.take(&event),
            Entry::Message { message: Message::Frame(frame), .. } => {
                greatest =
                    zero.rises(&frame).into_iter().filter(|rise| rise.is_finite()).fold(greatest, f32::max);
            }
            Entry::Run(_) | Entry::Attachment(_) | Entry::Message { .. } => {}
        }
    }
    Ok(greatest)
}

/// How grave an event is.
fn level_of(event: &pb::RunEvent) -> Level {
    match &event.event {
        Some(Event::StopRequested(_)) => Level::Error,
        Some(Event::Gap(_) | Event::PressRepeated(_) | Event::Paused(_) | Event::LeaseTaken(_)) => {
            Level::Warning
        }
        Some(Event::Finished(finished)) if finished.exit_status() != pb::ExitStatus::Done => Level::Warning,
        _ => Level::Info,
    }
}

/// A file of the viewers' messages being written.
struct Viewer {
    mcap: mcap::Writer<BufWriter<File>>,
    channels: [u16; Channel::ALL.len()],
    scene: Scene,
}

impl Viewer {
    fn create(path: &Path, rig: &Rig) -> Result<Self, mcap::McapError> {
        let file = BufWriter::new(File::create(path)?);
        let mut mcap = mcap::WriteOptions::new().profile("").library("tactus").create(file)?;
        let about = BTreeMap::from([
            ("rig".to_owned(), rig.name.clone()),
            ("simulated".to_owned(), rig.simulated.to_string()),
        ]);
        let mut channels = [0; Channel::ALL.len()];
        for (id, channel) in channels.iter_mut().zip(Channel::ALL) {
            let schema = mcap.add_schema(channel.schema(), ENCODING, SCHEMAS)?;
            *id = mcap.add_channel(schema, channel.topic(), ENCODING, &about)?;
        }
        Ok(Self { mcap, channels, scene: Scene::of(rig) })
    }

    fn put(&mut self, channel: Channel, message: &[u8], at: WallTime) -> Result<(), mcap::McapError> {
        let log_time = u64::try_from(at.ns()).unwrap_or(0);
        let channel_id = self.channels[channel as usize];
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        self.mcap.write_to_known_channel(&header, message)
    }

    fn frame(&mut self, rises: &[f32], white_counts: f32, at: WallTime) -> Result<(), mcap::McapError> {
        for (channel, message) in self.scene.frame(rises, white_counts, at).into_iter().flatten() {
            self.put(channel, &message, at)?;
        }
        Ok(())
    }

    fn log(&mut self, level: Level, name: &str, message: &str, at: WallTime) -> Result<(), mcap::McapError> {
        self.put(Channel::Log, &log_line(level, name, message, at), at)
    }
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}
