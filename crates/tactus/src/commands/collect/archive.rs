//! The files of a collection, which one thread writes.

mod files;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::{Context, anyhow};
use tactus_record::RecordError;
use tactus_schema::key::Topic;
use tactus_schema::{Frame, Rig, pb};
use tokio::sync::mpsc::{self, error::TrySendError};

use crate::exit::{Exit, Failure};
use files::Files;

/// Messages of all rigs that wait for the disk; whoever has more waits.
const QUEUE: usize = 4_096;

/// When a file is complete and the next one begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    span: Duration,
    bytes: u64,
}

/// The files of all rigs.
pub(super) struct Archive {
    rigs: BTreeSet<String>,
    to: mpsc::Sender<Entry>,
    thread: JoinHandle<Result<Collected, RecordError>>,
}

/// Where the messages of one rig go.
pub(super) struct Place {
    rig: Arc<str>,
    to: mpsc::Sender<Entry>,
}

/// Something heard of a rig, in order.
#[derive(Debug)]
pub(super) enum Heard {
    /// What the rig is: before any message.
    Described(Box<Described>),
    /// Why it does not say what it is.
    Undescribed(String),
    Info(pb::SensorInfo),
    Frame(Frame),
    Stage(pb::StageState),
    Event(Box<pb::RunEvent>),
    Safety(pb::SafetyEvent),
    /// The rig was started again; what follows is on another clock.
    Restarted,
    /// So many messages, which follow, did not arrive at first.
    AskedAgain(u64),
    /// So many messages of a topic, other than frames, never arrived.
    Lost(Topic, u64),
    /// So many messages, in all, were not the service's or not readable.
    Foreign(u64),
}

/// The collection ends, or nothing can be written any more.
#[derive(Debug)]
pub(super) struct Ended;

/// A rig as its service describes it.
#[derive(Debug)]
pub(super) struct Described {
    pub(super) rig: Rig,
    pub(super) rig_toml: String,
    pub(super) simulated: bool,
    /// Of the service.
    pub(super) version: String,
}

/// What was recorded of each rig.
pub(super) type Collected = BTreeMap<String, Totals>;

/// What was recorded of a rig, and what was not.
#[derive(Debug, Clone, Default)]
pub(super) struct Totals {
    pub(super) files: u64,
    pub(super) bytes: u64,
    pub(super) frames: u64,
    /// Between the device's driver and here.
    pub(super) frames_lost: u64,
    /// At the device; its service counted them.
    pub(super) frames_lost_at_device: u64,
    /// Other messages.
    pub(super) messages_lost: u64,
    pub(super) messages_asked_again: u64,
    pub(super) messages_foreign: u64,
    pub(super) restarts: u64,
    /// Why it is not recorded.
    pub(super) problem: Option<String>,
}

#[derive(Debug)]
enum Entry {
    Of(Arc<str>, Heard),
    /// A second is over.
    Tick,
}

impl Limits {
    pub(super) fn checked(roll_min: f64, roll_mib: u64) -> anyhow::Result<Self> {
        let span = Duration::try_from_secs_f64(roll_min * 60.0).ok().filter(|span| !span.is_zero());
        match (span, roll_mib.checked_mul(1024 * 1024)) {
            (Some(span), Some(bytes)) if bytes > 0 => Ok(Self { span, bytes }),
            _ => Err(Failure::new(Exit::Usage, "--roll-min and --roll-mib must be positive").into()),
        }
    }
}

impl Archive {
    /// Makes the folder and starts the thread.
    pub(super) fn start(folder: &Path, limits: Limits, who: String) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        let (to, entries) = mpsc::channel(QUEUE);
        let folder = folder.to_owned();
        let thread = thread::Builder::new()
            .name("archive".into())
            .spawn(move || write(entries, &folder, limits, &who))?;
        Ok(Self { rigs: BTreeSet::new(), to, thread })
    }

    pub(super) fn has(&self, rig: &str) -> bool {
        self.rigs.contains(rig)
    }

    /// A place for a rig's messages.
    pub(super) fn add(&mut self, rig: &str) -> Place {
        self.rigs.insert(rig.to_owned());
        Place { rig: rig.into(), to: self.to.clone() }
    }

    /// Looks at the files; fails if nothing can be written any more.
    pub(super) fn tick(&self) -> Result<(), Ended> {
        match self.to.try_send(Entry::Tick) {
            // The next one comes in a second.
            Ok(()) | Err(TrySendError::Full(_)) => Ok(()),
            Err(TrySendError::Closed(_)) => Err(Ended),
        }
    }

    /// Closes all files.
    ///
    /// # Errors
    /// If something could not be written.
    pub(super) async fn finish(self) -> anyhow::Result<Collected> {
        drop(self.to);
        let joined = tokio::task::spawn_blocking(|| self.thread.join()).await?;
        let written =
            joined.map_err(|_| anyhow!("the thread that writes has panicked; this is a defect of Tactus"))?;
        Ok(written?)
    }
}

impl Place {
    /// Waits for room; fails if nothing can be written any more.
    pub(super) async fn send(&self, heard: Heard) -> Result<(), Ended> {
        self.to.send(Entry::Of(Arc::clone(&self.rig), heard)).await.map_err(|_| Ended)
    }
}

impl Heard {
    pub(super) fn frame(frame: pb::Frame) -> Self {
        Self::Frame(frame.into())
    }

    pub(super) fn event(event: pb::RunEvent) -> Self {
        Self::Event(Box::new(event))
    }
}

impl Totals {
    /// True if something that was sent is not recorded.
    pub(super) fn is_lossy(&self) -> bool {
        self.frames_lost > 0 || self.messages_lost > 0 || self.messages_foreign > 0 || self.problem.is_some()
    }

    /// What a person should know; empty if there is nothing.
    pub(super) fn warning(&self) -> String {
        let mut words: Vec<_> = self.problem.iter().cloned().collect();
        if self.messages_foreign > 0 {
            words.push(format!("{} messages were not its service's", self.messages_foreign));
        }
        if self.restarts > 0 {
            words.push(format!(
                "started again {} times: what it sent last before may be missing",
                self.restarts
            ));
        }
        words.join("; ")
    }
}

/// Writes until nobody sends any more, or the disk fails; then closes all files.
fn write(
    mut entries: mpsc::Receiver<Entry>,
    folder: &Path,
    limits: Limits,
    who: &str,
) -> Result<Collected, RecordError> {
    let mut rigs: BTreeMap<Arc<str>, Files> = BTreeMap::new();
    let mut written = Ok(());
    while written.is_ok()
        && let Some(entry) = entries.blocking_recv()
    {
        written = match entry {
            Entry::Of(rig, heard) => {
                let files = rigs.entry(rig).or_insert_with_key(|rig| {
                    Files::new(rig, PathBuf::from(folder).join(&**rig), limits, who)
                });
                files.take(heard)
            }
            Entry::Tick => rigs.values_mut().try_for_each(Files::tick),
        };
    }
    // Whoever sends learns that nobody writes.
    drop(entries);
    for files in rigs.values_mut() {
        written = written.and(files.close());
    }
    written.map(|()| rigs.into_iter().map(|(rig, files)| (rig.to_string(), files.totals)).collect())
}
