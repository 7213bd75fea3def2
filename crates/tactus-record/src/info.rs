//! The summary of a recording.

use std::{collections::BTreeMap, fmt, path::Path};

use serde::Serialize;
use tactus_schema::{WallTime, pb};

use crate::{
    Completeness, Entry, RecordError, RunMetadata, Tally,
    header::VERSIONS_JSON,
    reader::{io_error, read_run},
};

/// The summary of a recording: as text for people, as JSON for programs.
#[derive(Debug, Clone, Serialize)]
pub struct Info {
    /// Path of the recording.
    pub path: String,
    /// Id of the run.
    pub run_id: String,
    /// Name of the experiment.
    pub experiment: String,
    /// Name of the rig.
    pub rig: String,
    /// Who started the run.
    pub who: String,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// Id of the earlier run that it goes on with, if it does.
    pub continues: Option<String>,
    /// When it began, RFC 3339, UTC.
    pub started: String,
    /// From the first message to the last.
    pub duration_s: f64,
    /// How the run ended, such as `done`; absent if the recording was never closed.
    pub exit_status: Option<&'static str>,
    /// The run's message when it ended; empty if it never ended.
    pub message: String,
    /// Number of frames recorded.
    pub frames: u64,
    /// Number of frames that the sensor took and that never arrived.
    pub frames_lost: u64,
    /// Number of frames that were received, but that a damaged part of the file had.
    pub frames_missing: u64,
    /// Number of gaps in the sequence of frames.
    pub gaps: u64,
    /// Number of presses with at least one completed dwell.
    pub presses: u32,
    /// Number of completed dwells.
    pub dwells: u32,
    /// Number of messages by topic.
    pub topics: BTreeMap<String, u64>,
    /// The files attached to it.
    pub attachments: Vec<AttachmentInfo>,
    /// Versions, by name, of everything that took part in the run.
    pub versions: BTreeMap<String, String>,
    /// How much of the file could be read.
    pub completeness: Completeness,
}

/// A file attached to a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AttachmentInfo {
    /// File name.
    pub name: String,
    /// Media type.
    pub media_type: String,
    /// Its size.
    pub bytes: u64,
}

/// Reads a whole recording and counts its contents.
///
/// # Errors
/// If the file cannot be read, is no MCAP file, or does not say which run it is. Damage is no error: it is reported
/// in [`Info::completeness`].
pub fn info(path: impl AsRef<Path>) -> Result<Info, RecordError> {
    let path = path.as_ref();
    let (run, mut reader) = read_run(path)?;
    let mut counts = Counts::default();
    for entry in reader.by_ref() {
        counts.take(entry.map_err(|source| io_error(path, source))?);
    }
    let completeness = reader.completeness().cloned().unwrap_or(Completeness::Complete);
    Ok(counts.into_info(path, run, completeness))
}

#[derive(Default)]
struct Counts {
    tally: Tally,
    topics: BTreeMap<String, u64>,
    attachments: Vec<AttachmentInfo>,
    versions: BTreeMap<String, String>,
}

impl Counts {
    fn take(&mut self, entry: Entry) {
        match entry {
            Entry::Run(_) => {}
            Entry::Attachment(file) => {
                if file.name == VERSIONS_JSON {
                    self.versions = serde_json::from_slice(&file.data).unwrap_or_default();
                }
                self.attachments.push(AttachmentInfo {
                    bytes: file.data.len() as u64,
                    name: file.name,
                    media_type: file.media_type,
                });
            }
            Entry::Message { topic, message, .. } => {
                self.tally.take(&message);
                if let Some(count) = self.topics.get_mut(&*topic) {
                    *count += 1;
                } else {
                    self.topics.insert(topic.to_string(), 1);
                }
            }
        }
    }

    fn into_info(self, path: &Path, run: RunMetadata, completeness: Completeness) -> Info {
        let Self { tally, topics, attachments, versions } = self;
        Info {
            path: path.display().to_string(),
            run_id: run.run_id,
            experiment: run.experiment,
            rig: run.rig,
            who: run.who,
            simulated: run.simulated,
            continues: run.continues,
            started: rfc3339(run.started),
            duration_s: tally.duration().as_secs_f64(),
            exit_status: tally.exit_status().map(pb::ExitStatus::word),
            message: tally.finished().map(|finished| finished.message.clone()).unwrap_or_default(),
            frames: tally.frames(),
            frames_lost: tally.frames_lost(),
            frames_missing: tally.frames_missing(),
            gaps: tally.gaps(),
            presses: tally.presses(),
            dwells: tally.dwells(),
            topics,
            attachments,
            versions,
            completeness,
        }
    }
}

/// UTC, to the second.
fn rfc3339(at: WallTime) -> String {
    jiff::Timestamp::from_second(at.ns().div_euclid(1_000_000_000))
        .map_or_else(|_| format!("{} ns", at.ns()), |time| time.to_string())
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let simulated = if self.simulated { " (SIMULATED)" } else { "" };
        writeln!(f, "run          {}{simulated}", self.run_id)?;
        writeln!(f, "experiment   {}", self.experiment)?;
        writeln!(f, "rig          {}", self.rig)?;
        writeln!(f, "who          {}", self.who)?;
        if let Some(earlier) = &self.continues {
            writeln!(f, "continues    {earlier}")?;
        }
        writeln!(f, "started      {}", self.started)?;
        writeln!(f, "duration     {:.1} s", self.duration_s)?;
        let colon = if self.message.is_empty() { "" } else { ": " };
        let status = self.exit_status.unwrap_or("open (never closed)");
        writeln!(f, "exit status  {status}{colon}{}", self.message)?;
        let missing = match self.frames_missing {
            0 => String::new(),
            missing => format!(", {missing} MISSING: they were received, and the file lacks them"),
        };
        let Self { frames, frames_lost, gaps, .. } = self;
        writeln!(f, "frames       {frames} recorded, {frames_lost} lost in {gaps} gaps{missing}")?;
        writeln!(f, "presses      {} with {} dwells", self.presses, self.dwells)?;
        for (index, (topic, count)) in self.topics.iter().enumerate() {
            writeln!(f, "{:<12} {topic}: {count}", if index == 0 { "topics" } else { "" })?;
        }
        for (index, file) in self.attachments.iter().enumerate() {
            writeln!(
                f,
                "{:<12} {}: {} bytes",
                if index == 0 { "attachments" } else { "" },
                file.name,
                file.bytes
            )?;
        }
        for (index, (name, version)) in self.versions.iter().enumerate() {
            writeln!(f, "{:<12} {name} {version}", if index == 0 { "versions" } else { "" })?;
        }
        writeln!(f, "file         {}", self.completeness)
    }
}
