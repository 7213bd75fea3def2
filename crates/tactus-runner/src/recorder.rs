//! Writes the engine's recording: directly in virtual time, on a separate thread in real time.
//!
//! | thread | does | waits for |
//! |---|---|---|
//! | the engine's | queues each message, and checks how old the oldest unwritten one is | nothing |
//! | recorder | writes the messages, ten times a second what has come; closes a chunk after half a second | the queue, the disk |
//! | recorder-sync | makes durable what was written | the recorder's word, every two seconds of the run; the disk |
//!
//! A disk that is slow to sync delays only the last of them.

mod backlog;
mod life;

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use tactus_engine::{Record, RecordFailure};
use tactus_record::{Missing, RecordError, Recording, Storage, SyncHandle};
use tactus_schema::{Frame, MonoTime, TimeStamp, pb};
use tracing::{error, warn};

use backlog::{Backlog, Lag};
use life::{Life, Living, Watched};

/// Capacity of the queue to the disk, in messages. The backlog's age fails a run earlier, except at rates beyond 4 kHz.
const QUEUE: u64 = 4096;

/// Messages are written together after this time: to wake a thread for each would cost as much as to write it. A kill costs as much more.
const GATHERED: Duration = Duration::from_millis(100);

/// Without messages for this time, the current chunk is closed.
const IDLE: Duration = Duration::from_millis(250);

/// What was written is made durable at least this often, in time of the run: with the disk's time for it, within five seconds.
const SYNC_EVERY: Duration = Duration::from_secs(2);

/// Data that are older than this and not durable are an alarm.
const UNSYNCED_MAX: Duration = Duration::from_secs(5);

/// Less free space during a run is an alarm.
const FREE_ALARM_BYTES: u64 = 32 * 1024 * 1024;

/// The longest that the end of a run waits for the disk.
const FINISH_PATIENCE: Duration = Duration::from_secs(10);

/// No time: nothing is waiting.
const NEVER: i64 = i64::MIN;

/// Writes directly: in virtual time nothing has to keep up with a clock.
#[derive(Debug)]
pub struct DirectRecorder(pub Recording);

/// Queues everything for a thread, so that a slow disk never delays acquisition.
#[derive(Debug)]
pub struct ThreadRecorder {
    entries: Sender<Entry>,
    /// Sends nothing. Its end says that nothing comes any more, and ends the wait for it.
    more: Sender<()>,
    backlog: Backlog,
    /// What found the queue full.
    refused: Missing,
    gauge: Gauge,
    ended: Receiver<Result<(), RecordError>>,
    path: String,
}

/// What a recorder is behind with, for health messages and watchdogs. Clones show the same recorder.
#[derive(Debug, Clone, Default)]
pub struct Gauge(Arc<Readings>);

#[derive(Debug)]
struct Readings {
    /// Number of messages that were written.
    written: AtomicU64,
    /// Messages of them that wait in memory for their chunk.
    unstored: Mutex<Missing>,
    /// Time of the oldest message that waits.
    oldest_ns: AtomicI64,
    /// Size of the messages that wait.
    waiting_bytes: AtomicU64,
    /// Everything up to this time of the run is durable.
    synced_ns: AtomicI64,
    failure: Notice,
    alarm: Notice,
    life: Life,
}

/// A text from one thread to another, which locks nothing as long as there is none.
#[derive(Debug, Default)]
struct Notice {
    is_given: AtomicBool,
    text: Mutex<Option<String>>,
}

impl Default for Readings {
    fn default() -> Self {
        Self {
            written: AtomicU64::new(0),
            unstored: Mutex::default(),
            oldest_ns: AtomicI64::new(NEVER),
            waiting_bytes: AtomicU64::new(0),
            synced_ns: AtomicI64::new(NEVER),
            failure: Notice::default(),
            alarm: Notice::default(),
            life: Life::default(),
        }
    }
}

/// Why a message was not taken, or the recording is not whole.
#[derive(Debug, thiserror::Error)]
enum QueueError {
    #[error(
        "the disk cannot keep up with {path}: messages have been waiting for {:.2} s; {messages} of them \
         ({bytes} bytes), with {frames} frames",
        age.as_secs_f64()
    )]
    Late { path: String, age: Duration, messages: u64, frames: u64, bytes: u64 },
    #[error("{0}")]
    Failed(String),
    #[error("the recording's thread ended early; this is a defect of Tactus")]
    Gone,
    #[error(
        "the disk did not answer within {} s: {messages} messages with {frames} frames are not in {path}, which has no end; \
         the service closes it at its next start",
        FINISH_PATIENCE.as_secs(), messages = missing.messages, frames = missing.frames
    )]
    Hung { path: String, missing: Missing },
    #[error(
        "the disk could not keep up with {path}: {messages} messages with {frames} frames are not in it",
        messages = missing.messages, frames = missing.frames
    )]
    Lossy { path: String, missing: Missing },
}

/// What is queued. The queue takes memory for 31 entries at once: only what comes many times a second stands in it.
#[derive(Debug)]
enum Entry {
    SensorInfo(Box<(pb::SensorInfo, TimeStamp)>),
    Frame(Frame),
    Stage(pb::StageState),
    Event(Box<pb::RunEvent>),
    Safety(Box<pb::SafetyEvent>),
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

impl Gauge {
    /// Number of messages that were written: it rises while the recorder makes progress.
    pub fn written(&self) -> u64 {
        self.0.written.load(Ordering::Relaxed)
    }

    /// Age of the oldest message that waits to be written; zero if none does.
    pub fn backlog(&self, now: MonoTime) -> Duration {
        age(&self.0.oldest_ns, now).unwrap_or_default()
    }

    /// Size of the messages that wait to be written.
    pub fn waiting_bytes(&self) -> u64 {
        self.0.waiting_bytes.load(Ordering::Relaxed)
    }

    /// Age of the oldest data that a loss of power would take; `None` if nothing is being recorded.
    pub fn unsynced(&self, now: MonoTime) -> Option<Duration> {
        age(&self.0.synced_ns, now)
    }

    /// A number that changes several times a second while the recorder's thread goes on. `None` if it is not expected to:
    /// nothing is being recorded, or the thread waits for the disk, which only the backlog may judge.
    pub fn sign_of_life(&self) -> Option<u64> {
        self.0.life.sign()
    }

    /// The failure of the recorder, if it has failed.
    pub fn failure(&self) -> Option<String> {
        self.0.failure.text()
    }

    /// What people should know of the recorder since the last call: it is late, or the disk is slow or nearly full. The
    /// log has it, too.
    pub fn take_alarm(&self) -> Option<String> {
        self.0.alarm.take()
    }

    fn alarm(&self, text: String) {
        warn!("{text}");
        self.0.alarm.give(text);
    }

    fn fail(&self, failure: &RecordError) {
        error!(%failure, "the recording fails");
        self.0.failure.give(failure.to_string());
    }

    fn unstored(&self) -> Missing {
        *self.0.unstored.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn show_unstored(&self, unstored: Missing) {
        *self.0.unstored.lock().unwrap_or_else(PoisonError::into_inner) = unstored;
    }

    fn show(&self, backlog: &Backlog) {
        self.0.oldest_ns.store(backlog.oldest().map_or(NEVER, MonoTime::ns), Ordering::Relaxed);
        self.0.waiting_bytes.store(backlog.bytes(), Ordering::Relaxed);
    }

    fn reset(&self) {
        self.0.written.store(0, Ordering::Relaxed);
        self.show_unstored(Missing::default());
        self.clear();
        self.0.failure.take();
        self.0.alarm.take();
    }

    fn clear(&self) {
        self.0.oldest_ns.store(NEVER, Ordering::Relaxed);
        self.0.waiting_bytes.store(0, Ordering::Relaxed);
        self.0.synced_ns.store(NEVER, Ordering::Relaxed);
    }
}

impl Notice {
    /// Gives a text, unless one is there.
    fn give(&self, text: String) {
        self.text.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
        self.is_given.store(true, Ordering::Release);
    }

    fn text(&self) -> Option<String> {
        let is_given = self.is_given.load(Ordering::Acquire);
        is_given.then(|| self.text.lock().unwrap_or_else(PoisonError::into_inner).clone()).flatten()
    }

    fn take(&self) -> Option<String> {
        let is_given = self.is_given.swap(false, Ordering::AcqRel);
        is_given.then(|| self.text.lock().unwrap_or_else(PoisonError::into_inner).take()).flatten()
    }
}

fn age(since_ns: &AtomicI64, now: MonoTime) -> Option<Duration> {
    match since_ns.load(Ordering::Relaxed) {
        NEVER => None,
        since_ns => Some(now.since(MonoTime::from_ns(since_ns))),
    }
}

impl ThreadRecorder {
    /// Starts the threads.
    ///
    /// # Errors
    /// If the system gives no threads or no second handle to the file.
    pub fn start<S: Storage + 'static>(recording: Recording<S>) -> std::io::Result<Self> {
        Self::start_with(recording, Gauge::default())
    }

    /// Starts the threads. The gauge shows this recorder from now on.
    ///
    /// # Errors
    /// As [`ThreadRecorder::start`].
    pub fn start_with<S: Storage + 'static>(recording: Recording<S>, gauge: Gauge) -> std::io::Result<Self> {
        Self::start_gathering(GATHERED, recording, gauge)
    }

    fn start_gathering<S: Storage + 'static>(
        gathered: Duration,
        recording: Recording<S>,
        gauge: Gauge,
    ) -> std::io::Result<Self> {
        gauge.reset();
        let path = recording.path().display().to_string();
        // Overflow policy: never dropped; a full queue is an error that fails the run.
        // Its bound is checked before each message: a bounded channel would take the memory of a full queue at once.
        let (entries, queue) = channel();
        let (more, end_of_more) = channel();
        // The result of one recording.
        let (end, ended) = sync_channel(1);
        let sync = recording.sync_handle().map_err(std::io::Error::other)?;
        // One request at a time: a second one while the disk is busy would change nothing.
        let (sync_to, wishes) = sync_channel(1);
        let of_sync = gauge.clone();
        thread::Builder::new()
            .name("recorder-sync".into())
            .spawn(move || sync_all(sync, &wishes, &of_sync))?;
        // From here on the thread has to show that it goes on.
        let living = Living::begin(gauge.clone());
        let recording = recording.map_storage(|storage| Watched::new(storage, gauge.clone()));
        let writer = Writer {
            queue,
            gathered,
            end_of_more,
            recording,
            gauge: gauge.clone(),
            sync_to,
            wished: None,
            at: MonoTime::default(),
        };
        thread::Builder::new().name("recorder".into()).spawn(move || {
            let _living = living;
            let result = writer.write_all();
            // Nobody may wait for the result any more.
            let _told = end.send(result);
        })?;
        Ok(Self {
            entries,
            more,
            backlog: Backlog::default(),
            refused: Missing::default(),
            gauge,
            ended,
            path,
        })
    }

    /// Checks without a message whether the recorder keeps up: for times in which no message comes.
    ///
    /// # Errors
    /// As for a message.
    pub fn check(&mut self, now: MonoTime) -> Result<(), RecordFailure> {
        if let Some(failure) = self.gauge.failure() {
            return Err(RecordFailure(Box::new(QueueError::Failed(failure))));
        }
        let lag = self.backlog.check(self.gauge.written(), now);
        self.gauge.show(&self.backlog);
        match lag {
            Lag::KeepsUp => Ok(()),
            Lag::Alarm(age) => {
                let (path, messages, age_s) = (&self.path, self.backlog.messages(), age.as_secs_f64());
                self.gauge.alarm(format!(
                    "the disk is late: {messages} messages have been waiting for {path} for {age_s:.2} s"
                ));
                Ok(())
            }
            Lag::TooLate(age) => Err(self.late(age)),
        }
    }

    /// As [`Record::finish`], but waits for the disk this long at most.
    ///
    /// # Errors
    /// As [`Record::finish`].
    pub fn finish_within(self, patience: Duration) -> Result<(), RecordFailure> {
        let Self { entries, more, mut backlog, refused, gauge, ended, path } = self;
        // The thread ends when the queue does; then everything is on disk.
        drop((entries, more));
        let result = match ended.recv_timeout(patience) {
            Ok(Ok(())) if refused.messages > 0 => {
                Err(RecordFailure(Box::new(QueueError::Lossy { path, missing: refused })))
            }
            Ok(written) => written.map_err(failure),
            Err(RecvTimeoutError::Disconnected) => Err(RecordFailure(Box::new(QueueError::Gone))),
            Err(RecvTimeoutError::Timeout) => {
                backlog.settle(gauge.written());
                let missing = backlog.waiting().plus(gauge.unstored()).plus(refused);
                Err(RecordFailure(Box::new(QueueError::Hung { path, missing })))
            }
        };
        gauge.clear();
        // A failure beside the writer's, such as of a sync, fails the run, too.
        result.and(
            gauge.failure().map_or(Ok(()), |text| Err(RecordFailure(Box::new(QueueError::Failed(text))))),
        )
    }

    fn queue(&mut self, entry: Entry) -> Result<(), RecordFailure> {
        let (at, bytes, is_frame) = (entry.at(), entry.bytes(), matches!(entry, Entry::Frame(_)));
        self.backlog.settle(self.gauge.written());
        if self.backlog.messages() >= QUEUE {
            self.refused = self.refused.plus(Missing::message(is_frame));
            self.check(at)?;
            let age = self.gauge.backlog(at);
            return Err(self.late(age));
        }
        if self.entries.send(entry).is_err() {
            self.refused = self.refused.plus(Missing::message(is_frame));
            self.check(at)?;
            return Err(RecordFailure(Box::new(QueueError::Gone)));
        }
        self.backlog.queued(at, bytes, is_frame);
        self.check(at)
    }

    fn late(&self, age: Duration) -> RecordFailure {
        RecordFailure(Box::new(QueueError::Late {
            path: self.path.clone(),
            age,
            messages: self.backlog.messages(),
            frames: self.backlog.frames(),
            bytes: self.backlog.bytes(),
        }))
    }
}

impl Record for ThreadRecorder {
    fn sensor_info(&mut self, info: &pb::SensorInfo, at: TimeStamp) -> Result<(), RecordFailure> {
        self.queue(Entry::SensorInfo(Box::new((info.clone(), at))))
    }

    fn frame(&mut self, frame: &Frame) -> Result<(), RecordFailure> {
        self.queue(Entry::Frame(frame.clone()))
    }

    fn stage(&mut self, state: &pb::StageState) -> Result<(), RecordFailure> {
        self.queue(Entry::Stage(*state))
    }

    fn event(&mut self, event: &pb::RunEvent) -> Result<(), RecordFailure> {
        self.queue(Entry::Event(Box::new(event.clone())))
    }

    fn safety(&mut self, event: &pb::SafetyEvent) -> Result<(), RecordFailure> {
        self.queue(Entry::Safety(Box::new(event.clone())))
    }

    fn check(&mut self, now: MonoTime) -> Result<(), RecordFailure> {
        Self::check(self, now)
    }

    fn alarm(&mut self) -> Option<String> {
        self.gauge.take_alarm()
    }

    fn finish(self: Box<Self>) -> Result<(), RecordFailure> {
        self.finish_within(FINISH_PATIENCE)
    }
}

impl Entry {
    /// About how much memory it takes.
    fn bytes(&self) -> u64 {
        let text = match self {
            Self::Frame(frame) => size_of_val(&*frame.counts),
            Self::Event(event) => prost::Message::encoded_len(&**event),
            Self::Safety(event) => prost::Message::encoded_len(&**event),
            Self::SensorInfo(told) => prost::Message::encoded_len(&told.0),
            Self::Stage(_) => 0,
        };
        (size_of::<Self>() + text) as u64
    }

    fn at(&self) -> MonoTime {
        match self {
            Self::SensorInfo(told) => told.1.mono,
            Self::Frame(frame) => frame.received.mono,
            Self::Stage(state) => MonoTime::from_ns(state.t_mono_ns),
            Self::Event(event) => MonoTime::from_ns(event.t_mono_ns),
            Self::Safety(event) => MonoTime::from_ns(event.t_mono_ns),
        }
    }
}

/// The recorder thread.
struct Writer<S> {
    /// It goes with the writer, also after a panic: who sees that the thread has ended finds that it takes no message.
    queue: Receiver<Entry>,
    /// After so long it looks into the queue again.
    gathered: Duration,
    end_of_more: Receiver<()>,
    recording: Recording<S>,
    gauge: Gauge,
    sync_to: SyncSender<MonoTime>,
    /// Time of the run at which a sync was last requested.
    wished: Option<MonoTime>,
    at: MonoTime,
}

impl<S: Storage> Writer<S> {
    /// Writes until the queue ends. After a failure it takes what comes nevertheless: the recording keeps what it can.
    fn write_all(mut self) -> Result<(), RecordError> {
        loop {
            self.gauge.0.life.beat();
            match self.queue.recv_timeout(IDLE) {
                Ok(entry) => {
                    self.take(&entry);
                    self.take_gathered();
                    // Times out, or ends with the queue.
                    let _waited = self.end_of_more.recv_timeout(self.gathered);
                }
                Err(RecvTimeoutError::Timeout) => {
                    let flushed = self.recording.flush();
                    self.note(flushed);
                }
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        // The handle for syncs must not outlive the recording by more than the sync in progress.
        drop(self.sync_to);
        self.recording.finish().map(drop)
    }

    /// Writes what is in the queue.
    fn take_gathered(&mut self) {
        while let Ok(entry) = self.queue.try_recv() {
            self.gauge.0.life.beat();
            self.take(&entry);
        }
    }

    fn take(&mut self, entry: &Entry) {
        let written = self.write(entry);
        self.gauge.show_unstored(self.recording.unstored());
        self.gauge.0.written.fetch_add(1, Ordering::Relaxed);
        self.note(written);
    }

    fn note(&self, written: Result<(), RecordError>) {
        if let Err(failure) = written
            && self.gauge.failure().is_none()
        {
            self.gauge.fail(&failure);
        }
    }

    fn write(&mut self, entry: &Entry) -> Result<(), RecordError> {
        self.at = self.at.max(entry.at());
        self.wish_for_sync();
        match entry {
            Entry::SensorInfo(told) => self.recording.write_sensor_info(&told.0, told.1),
            Entry::Frame(frame) => self.recording.write(frame),
            Entry::Stage(state) => self.recording.write(state),
            Entry::Event(event) => self.recording.write(&**event),
            Entry::Safety(event) => self.recording.write(&**event),
        }
    }

    fn wish_for_sync(&mut self) {
        let wished = *self.wished.get_or_insert_with(|| {
            self.gauge.0.synced_ns.store(self.at.ns(), Ordering::Relaxed);
            self.at
        });
        if self.at.since(wished) < SYNC_EVERY {
            return;
        }
        self.wished = Some(self.at);
        if self.sync_to.try_send(self.at).is_err() {
            let unsynced = self.gauge.unsynced(self.at).unwrap_or_default();
            if unsynced > UNSYNCED_MAX {
                let unsynced_s = unsynced.as_secs_f64();
                self.gauge.alarm(format!(
                    "the disk is slow: a loss of power would cost the last {unsynced_s:.1} s"
                ));
            }
        }
    }
}

/// The sync thread. Its failure fails the run.
fn sync_all(mut sync: Box<dyn SyncHandle>, wishes: &Receiver<MonoTime>, gauge: &Gauge) {
    let mut nearly_full = false;
    for at in wishes {
        match sync.sync() {
            Ok(()) => gauge.0.synced_ns.store(at.ns(), Ordering::Relaxed),
            Err(failure) => return gauge.fail(&failure),
        }
        // Only an alarm: whether the disk is full, the next write will tell.
        let free_bytes = sync.free_bytes().unwrap_or(u64::MAX);
        if free_bytes < FREE_ALARM_BYTES && !std::mem::replace(&mut nearly_full, true) {
            let free_mib = free_bytes / (1024 * 1024);
            gauge.alarm(format!("the disk of the recordings is nearly full: {free_mib} MiB are free"));
        }
    }
}

fn failure(error: RecordError) -> RecordFailure {
    RecordFailure(Box::new(error))
}

#[cfg(test)]
#[path = "recorder_tests.rs"]
mod tests;
