//! Writes a recording.

use std::{
    fmt,
    fs::{File, OpenOptions},
    path::{Path, PathBuf},
};

use tactus_schema::{TimeStamp, pb};

use crate::{RecordError, Tally, Timed, channel::ChannelWriter, header::Header};

/// One run being written to an MCAP file.
///
/// Each call returns once the message is in the current chunk. A chunk reaches the system when it spans half a second of
/// message time, so a killed process loses at most that. After an error every call fails, and the caller fails the run. If
/// the recording is dropped unfinished, the file is complete, but its run stays open.
pub struct Recording {
    path: PathBuf,
    writer: ChannelWriter<File>,
    tally: Tally,
    sensor_infos: u64,
}

/// The totals of a finished recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Where it was written.
    pub path: PathBuf,
    /// Size of the file.
    pub bytes: u64,
    /// Number of frames recorded: all that were received.
    pub frames: u64,
    /// Number of frames that the sensor took and that never arrived.
    pub frames_lost: u64,
    /// Number of gaps in the sequence of frames.
    pub gaps: u64,
    /// Number of presses with at least one completed dwell.
    pub presses: u32,
    /// Number of completed dwells.
    pub dwells: u32,
    /// From the first message to the last.
    pub duration_s: f64,
    /// How the run ended, as its last event says; `None` if there was none.
    pub exit_status: Option<pb::ExitStatus>,
}

impl Recording {
    /// Creates the file and writes everything of `header` into it. An existing file is never overwritten.
    ///
    /// # Errors
    /// If the file exists or cannot be written.
    pub fn create(path: impl Into<PathBuf>, header: &Header<'_>) -> Result<Self, RecordError> {
        let path = path.into();
        let file = match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(file) => file,
            Err(source) => return Err(RecordError::Io { action: "create", path, source }),
        };
        match ChannelWriter::new(file, header) {
            Ok(writer) => Ok(Self { path, writer, tally: Tally::default(), sensor_infos: 0 }),
            Err(source) => Err(RecordError::Write { path, source }),
        }
    }

    /// Where it is written.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Totals of the messages recorded so far.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Records a message at its own time: a frame, a report of the stage, an event of the run, a verdict of the safety
    /// supervisor.
    ///
    /// # Errors
    /// If an earlier chunk could not be written; all later calls fail, too.
    pub fn write<M: Timed>(&mut self, message: &M) -> Result<(), RecordError> {
        message.count(&mut self.tally);
        let written = self.writer.write(message, message.seq(), message.at());
        self.checked(written)
    }

    /// Records the sensor's description of itself, which has no time of its own.
    ///
    /// # Errors
    /// As [`Recording::write`].
    pub fn write_sensor_info(&mut self, info: &pb::SensorInfo, at: TimeStamp) -> Result<(), RecordError> {
        self.tally.time(at.mono);
        let nth = self.sensor_infos;
        self.sensor_infos += 1;
        let written = self.writer.write(info, nth, at);
        self.checked(written)
    }

    /// Gives all messages so far to the system. Only needed when no messages come; otherwise they do it.
    ///
    /// # Errors
    /// As [`Recording::write`].
    pub fn flush(&mut self) -> Result<(), RecordError> {
        let flushed = self.writer.flush();
        self.checked(flushed)
    }

    /// Closes the file; returns once it is on disk.
    ///
    /// # Errors
    /// If earlier messages could not be stored.
    pub fn finish(self) -> Result<Summary, RecordError> {
        let Self { path, writer, tally, .. } = self;
        let file = match writer.finish() {
            Ok(file) => file,
            Err(source) => return Err(RecordError::Write { path, source }),
        };
        let bytes = match file.sync_all().and_then(|()| file.metadata()) {
            Ok(metadata) => metadata.len(),
            Err(source) => return Err(RecordError::Io { action: "sync", path, source }),
        };
        Ok(Summary {
            path,
            bytes,
            frames: tally.frames(),
            frames_lost: tally.frames_lost(),
            gaps: tally.gaps(),
            presses: tally.presses(),
            dwells: tally.dwells(),
            duration_s: tally.duration().as_secs_f64(),
            exit_status: tally.exit_status(),
        })
    }

    fn checked(&self, written: Result<(), mcap::McapError>) -> Result<(), RecordError> {
        written.map_err(|source| RecordError::Write { path: self.path.clone(), source })
    }
}

impl fmt::Debug for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recording")
            .field("path", &self.path)
            .field("tally", &self.tally)
            .finish_non_exhaustive()
    }
}
