//! Writes a recording.

use std::{
    fmt, fs, io,
    path::{Path, PathBuf},
};

use tactus_schema::{
    TimeStamp,
    pb::{self, run_event::Event},
};

use crate::{
    MessageKind, RecordError, Tally, Timed,
    error::Missing,
    header::Header,
    message::Recorded,
    space::{INDEX_BYTES_PER_CHUNK, end_bytes},
    storage::{FileStorage, Storage, SyncHandle},
    stream::ChannelWriter,
};

/// One run being written to an MCAP file.
///
/// Each call returns once the message is in the current chunk. A chunk reaches the system when it spans half a second of
/// message time, so a killed process loses at most that. A [`SyncHandle`] makes it durable.
///
/// If the storage fails, every later call fails, too, and the caller fails the run. Messages that are written after that
/// are kept in memory as long as the reserve has room for them. [`Recording::finish`] then writes them into the reserve, with the event that
/// the run failed, and says what is missing.
///
/// If the recording is dropped unfinished, its file ends with the last chunk, as after a kill.
pub struct Recording<S = FileStorage> {
    path: PathBuf,
    storage: S,
    writer: ChannelWriter,
    tally: Tally,
    sensor_infos: u64,
    run_id: String,
    next_event: u64,
    last_at: TimeStamp,
    /// Number of times that chunks were stored.
    stored: u64,
    /// Size of the end of the recording, without its index of chunks.
    end_bytes: u64,
    /// Taken in since chunks were last stored.
    unstored: Missing,
    failure: Option<Failure>,
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

/// The storage's failure, and what could not be stored.
struct Failure {
    source: io::Error,
    /// Whole records, in order.
    kept: Vec<u8>,
    missing: Missing,
}

impl Recording {
    /// Creates the file and writes everything of `header` into it, durably. An existing file is never overwritten.
    ///
    /// # Errors
    /// If the file exists or cannot be written.
    pub fn create(path: impl Into<PathBuf>, header: &Header<'_>) -> Result<Self, RecordError> {
        let path = path.into();
        let storage = FileStorage::create(&path)?;
        let begun = Self::begin(path.clone(), storage, header).and_then(|recording| {
            recording.sync_handle()?.sync()?;
            Ok(recording)
        });
        if begun.is_err() {
            // An error of the removal would hide the one that matters.
            drop(fs::remove_file(&path));
        }
        begun
    }
}

impl<S: Storage> Recording<S> {
    /// Begins a recording on any storage; `path` is for messages.
    ///
    /// # Errors
    /// If `header` cannot be written.
    pub fn begin(path: PathBuf, mut storage: S, header: &Header<'_>) -> Result<Self, RecordError> {
        let end_bytes = end_bytes(header.rig);
        let mut writer = match ChannelWriter::new(header) {
            Ok(writer) => writer,
            Err(source) => return Err(RecordError::Write { path, source }),
        };
        let stored = storage.keep_reserve(end_bytes).and_then(|()| storage.append(&writer.take_closed()));
        if let Err(source) = stored {
            return Err(RecordError::Store { path, source, missing: Missing::default() });
        }
        Ok(Self {
            path,
            storage,
            writer,
            tally: Tally::default(),
            sensor_infos: 0,
            run_id: header.run_id.to_owned(),
            next_event: 0,
            last_at: TimeStamp::default(),
            stored: 0,
            end_bytes,
            unstored: Missing::default(),
            failure: None,
        })
    }

    /// The same recording with another storage around its own: for those who watch what the storage does.
    pub fn map_storage<T: Storage>(self, around: impl FnOnce(S) -> T) -> Recording<T> {
        let Self {
            path,
            storage,
            writer,
            tally,
            sensor_infos,
            run_id,
            next_event,
            last_at,
            stored,
            end_bytes,
            unstored,
            failure,
        } = self;
        Recording {
            path,
            storage: around(storage),
            writer,
            tally,
            sensor_infos,
            run_id,
            next_event,
            last_at,
            stored,
            end_bytes,
            unstored,
            failure,
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

    /// Messages that wait in memory until their chunk is full.
    pub fn unstored(&self) -> Missing {
        self.unstored
    }

    /// A handle that makes durable what has reached the system, for another thread.
    ///
    /// # Errors
    /// If the system gives none.
    pub fn sync_handle(&self) -> Result<Box<dyn SyncHandle>, RecordError> {
        let error =
            |source| RecordError::Io { action: "open a second time", path: self.path.clone(), source };
        self.storage.sync_handle().map_err(error)
    }

    /// Records a message at its own time: a frame, a report of the stage, an event of the run, a verdict of the safety
    /// supervisor.
    ///
    /// # Errors
    /// If the storage failed, now or earlier.
    pub fn write<M: Timed>(&mut self, message: &M) -> Result<(), RecordError> {
        if M::KIND == MessageKind::Event {
            self.next_event = message.seq().saturating_add(1);
        }
        self.put(message, message.seq(), message.at())
    }

    /// Records the sensor's description of itself, which has no time of its own.
    ///
    /// # Errors
    /// As [`Recording::write`].
    pub fn write_sensor_info(&mut self, info: &pb::SensorInfo, at: TimeStamp) -> Result<(), RecordError> {
        self.tally.time(at.mono);
        let nth = self.sensor_infos;
        self.sensor_infos += 1;
        self.put(info, nth, at)
    }

    /// Gives all messages so far to the system. Only needed when no messages come; otherwise they do it.
    ///
    /// # Errors
    /// As [`Recording::write`].
    pub fn flush(&mut self) -> Result<(), RecordError> {
        let closed = self.writer.close_chunk();
        self.encoded(closed)?;
        self.store()
    }

    /// Closes the file; returns once it is on disk, under its name.
    ///
    /// # Errors
    /// If earlier messages could not be stored, or the end cannot be.
    pub fn finish(mut self) -> Result<Summary, RecordError> {
        self.storage.release_reserve();
        if self.failure.is_some() && self.tally.finished().is_none() {
            self.fail_run();
        }
        let finished = self.writer.finish();
        self.encoded(finished)?;
        let path = self.path.clone();
        let ended = match &mut self.failure {
            None => self.storage.append(&self.writer.take_closed()),
            Some(failure) => {
                failure.kept.append(&mut self.writer.take_closed());
                self.storage.append(&failure.kept)
            }
        };
        match (ended, self.failure) {
            (Ok(()), None) => {}
            (Ok(()), Some(Failure { source, missing, .. })) => {
                self.storage.close()?;
                return Err(RecordError::Store { path, source, missing: Missing { told: true, ..missing } });
            }
            (Err(source), None) => {
                return Err(RecordError::Store {
                    path,
                    source,
                    missing: Missing { unclosed: true, ..self.unstored },
                });
            }
            (Err(_), Some(Failure { source, missing, .. })) => {
                let missing = Missing { unclosed: true, ..missing.plus(self.unstored) };
                return Err(RecordError::Store { path, source, missing });
            }
        }
        let bytes = self.storage.close()?;
        let tally = self.tally;
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

    fn put<M: Recorded>(&mut self, message: &M, seq: u64, at: TimeStamp) -> Result<(), RecordError> {
        let one = Missing::one(M::KIND);
        let room = self.end_bytes / 2;
        if let Some(failure) = &mut self.failure
            && failure.kept.len() as u64 > room
            && M::KIND != MessageKind::Event
        {
            failure.missing = failure.missing.plus(one);
            return Err(self.failed());
        }
        self.last_at = at;
        message.count(&mut self.tally);
        let written = self.writer.write(message, seq, at);
        self.encoded(written)?;
        // What is closed now does not have this message yet.
        let stored = self.store();
        self.unstored = self.unstored.plus(one);
        stored
    }

    /// Gives the closed chunks to the storage.
    fn store(&mut self) -> Result<(), RecordError> {
        let mut closed = self.writer.take_closed();
        if let Some(failure) = &mut self.failure {
            failure.kept.append(&mut closed);
            return Err(self.failed());
        }
        if closed.is_empty() {
            return Ok(());
        }
        let appended = self.storage.append(&closed);
        if appended.is_ok() {
            closed.clear();
            self.stored += 1;
            self.unstored = Missing::default();
        }
        let reserve_bytes = self.end_bytes + self.stored * INDEX_BYTES_PER_CHUNK;
        appended.and_then(|()| self.storage.keep_reserve(reserve_bytes)).map_err(|source| {
            self.failure = Some(Failure { source, kept: closed, missing: Missing::default() });
            self.failed()
        })
    }

    /// The error of every call after the storage has failed.
    fn failed(&self) -> RecordError {
        let (source, missing) = match &self.failure {
            Some(failure) => (again(&failure.source), failure.missing),
            None => (io::ErrorKind::Other.into(), Missing::default()),
        };
        RecordError::Store { path: self.path.clone(), source, missing }
    }

    fn encoded(&self, encoded: Result<(), mcap::McapError>) -> Result<(), RecordError> {
        encoded.map_err(|source| RecordError::Write { path: self.path.clone(), source })
    }

    /// Adds the event that the run failed because the recording did.
    fn fail_run(&mut self) {
        let event = pb::RunEvent {
            seq: self.next_event,
            run_id: self.run_id.clone(),
            t_mono_ns: self.last_at.mono.ns(),
            t_wall_ns: self.last_at.wall.ns(),
            event: Some(Event::Finished(
                self.tally.finish(pb::ExitStatus::Failed, self.failed().to_string()),
            )),
        };
        // It is kept in memory, and the recording's error is told by the caller.
        drop(self.write(&event));
    }
}

/// The same error once more.
fn again(error: &io::Error) -> io::Error {
    match error.raw_os_error() {
        Some(code) => io::Error::from_raw_os_error(code),
        None => io::Error::new(error.kind(), error.to_string()),
    }
}

impl<S> fmt::Debug for Recording<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recording")
            .field("path", &self.path)
            .field("tally", &self.tally)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
#[path = "recording_tests.rs"]
mod tests;
