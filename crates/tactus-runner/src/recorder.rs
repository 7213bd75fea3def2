//! Writes the engine's recording: directly in virtual time, on a separate thread in real time.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use tactus_engine::{Record, RecordFailure};
use tactus_record::{RecordError, Recording};
use tactus_schema::{Frame, TimeStamp, pb};

/// Capacity of the queue to the disk: about a minute of frames, reports and events. If it is full the run fails.
const QUEUE: usize = 4096;

/// Writes directly: in virtual time nothing has to keep up with a clock.
#[derive(Debug)]
pub struct DirectRecorder(pub Recording);

/// Queues everything for a thread, so that a slow disk never delays acquisition.
#[derive(Debug)]
pub struct ThreadRecorder {
    entries: SyncSender<Entry>,
    writer: JoinHandle<Result<(), RecordError>>,
}

/// The disk could not keep up, or writing failed earlier.
#[derive(Debug, thiserror::Error)]
enum QueueError {
    #[error("the disk cannot keep up: {QUEUE} entries are waiting to be written")]
    Full,
    #[error("the recording's thread ended early; its error follows when the recording is closed")]
    Gone,
    #[error("the recording's thread panicked; this is a defect of Tactus")]
    Panicked,
}

#[derive(Debug)]
enum Entry {
    SensorInfo(pb::SensorInfo, TimeStamp),
    Frame(Frame),
    Stage(pb::StageState),
    Event(pb::RunEvent),
    Safety(pb::SafetyEvent),
}

impl Record for DirectRecorder {
    fn sensor_info(&mut self, info: &pb::SensorInfo, at: TimeStamp) -> Result<(), RecordFailure> {
        self.0.write_sensor_info(info, at).map_err(failure)
    }

    fn frame(&mut self, frame: &Frame) -> Result<(), RecordFailure> {
        self.0.write(frame).map_err(failure)
    }

    fn stage(&mut self, state: &pb::StageState) -> Result<(), RecordFailure> {
        self.0.write(state).map_err(failure)
    }

    fn event(&mut self, event: &pb::RunEvent) -> Result<(), RecordFailure> {
        self.0.write(event).map_err(failure)
    }

    fn safety(&mut self, event: &pb::SafetyEvent) -> Result<(), RecordFailure> {
        self.0.write(event).map_err(failure)
    }

    fn finish(self: Box<Self>) -> Result<(), RecordFailure> {
        self.0.finish().map(drop).map_err(failure)
    }
}

impl ThreadRecorder {
    /// Starts the thread.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn start(recording: Recording) -> std::io::Result<Self> {
        // Overflow policy: never dropped; a full queue is an error that fails the run.
        let (entries, queue) = sync_channel(QUEUE);
        let writer =
            thread::Builder::new().name("recorder".into()).spawn(move || write_all(recording, &queue))?;
        Ok(Self { entries, writer })
    }

    fn queue(&self, entry: Entry) -> Result<(), RecordFailure> {
        self.entries.try_send(entry).map_err(|refused| {
            RecordFailure(Box::new(match refused {
                TrySendError::Full(_) => QueueError::Full,
                TrySendError::Disconnected(_) => QueueError::Gone,
            }))
        })
    }
}

impl Record for ThreadRecorder {
    fn sensor_info(&mut self, info: &pb::SensorInfo, at: TimeStamp) -> Result<(), RecordFailure> {
        self.queue(Entry::SensorInfo(info.clone(), at))
    }

    fn frame(&mut self, frame: &Frame) -> Result<(), RecordFailure> {
        self.queue(Entry::Frame(frame.clone()))
    }

    fn stage(&mut self, state: &pb::StageState) -> Result<(), RecordFailure> {
        self.queue(Entry::Stage(*state))
    }

    fn event(&mut self, event: &pb::RunEvent) -> Result<(), RecordFailure> {
        self.queue(Entry::Event(event.clone()))
    }

    fn safety(&mut self, event: &pb::SafetyEvent) -> Result<(), RecordFailure> {
        self.queue(Entry::Safety(event.clone()))
    }

    fn finish(self: Box<Self>) -> Result<(), RecordFailure> {
        // The thread ends when the queue does; then everything is on disk.
        drop(self.entries);
        match self.writer.join() {
            Ok(written) => written.map_err(failure),
            Err(_) => Err(RecordFailure(Box::new(QueueError::Panicked))),
        }
    }
}

fn write_all(mut recording: Recording, queue: &Receiver<Entry>) -> Result<(), RecordError> {
    for entry in queue {
        match &entry {
            Entry::SensorInfo(info, at) => recording.write_sensor_info(info, *at),
            Entry::Frame(frame) => recording.write(frame),
            Entry::Stage(state) => recording.write(state),
            Entry::Event(event) => recording.write(event),
            Entry::Safety(event) => recording.write(event),
        }?;
    }
    recording.finish().map(drop)
}

fn failure(error: RecordError) -> RecordFailure {
    RecordFailure(Box::new(error))
}
