//! Notifications for systemd: ready, alive, stopping. Without systemd nobody is notified.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{self, SyncSender};
use std::thread;
use std::time::Duration;

use sd_notify::NotifyState;
use tactus_engine::{Engine, StopOrder};
use tactus_runner::recorder::Gauge;
use tactus_schema::MonoTime;
use tokio::sync::watch;
use tokio::time::{MissedTickBehavior, interval};
use tracing::{error, info, warn};

use crate::service::{CommandDesk, RunningDesks};

/// The watchdog's limit where systemd sets none.
const LIMIT: Duration = Duration::from_secs(2);

/// Messages that wait for a systemd that does not read.
const WAITING_MAX: usize = 4;

/// The way to systemd. A thread of its own writes to it, because a write waits while systemd does not read.
#[derive(Debug, Clone)]
pub(crate) struct Systemd(SyncSender<Message>);

/// What systemd is told.
#[derive(Debug, PartialEq, Eq)]
enum Message {
    Ready { status: String },
    Status(String),
    Alive,
    Hangs,
    Stopping,
}

impl Systemd {
    /// Starts the thread. It ends with the last handle.
    pub(crate) fn start() -> io::Result<Self> {
        let (to_tell, messages) = mpsc::sync_channel(WAITING_MAX);
        thread::Builder::new()
            .name("notify".into())
            .spawn(move || messages.into_iter().for_each(|message: Message| message.write()))?;
        Ok(Self(to_tell))
    }

    /// Frames flow: the service is ready.
    pub(crate) fn ready(&self, status: &str) {
        self.tell(Message::Ready { status: status.to_owned() });
    }

    /// How the service stands, in a line.
    pub(crate) fn status(&self, status: &str) {
        self.tell(Message::Status(status.to_owned()));
    }

    /// The service is closing down.
    pub(crate) fn stopping(&self) {
        self.tell(Message::Stopping);
    }

    /// Never waits.
    fn tell(&self, message: Message) {
        if let Err(error) = self.0.try_send(message) {
            tracing::debug!(%error, "systemd is not told");
        }
    }
}

impl Message {
    fn write(self) {
        let states = match &self {
            Self::Ready { status } => vec![NotifyState::Ready, NotifyState::Status(status)],
            Self::Status(status) => vec![NotifyState::Status(status)],
            Self::Alive => vec![NotifyState::Watchdog],
            Self::Hangs => vec![NotifyState::WatchdogTrigger],
            Self::Stopping => vec![NotifyState::Stopping],
        };
        if let Err(error) = sd_notify::notify(&states) {
            warn!(%error, "systemd could not be notified");
        }
    }
}

/// Feeds the watchdog while every part of the service makes progress. If one hangs, its rig's stage is stopped. If a part of every
/// rig still hangs an eighth of the limit later, systemd is asked to end the service; with several rigs, the runs of the others
/// are more than what one that hangs could gain. A disk that hangs is no part of the service: the run fails by it, and the service goes on.
pub(crate) async fn feed_watchdog(desks: RunningDesks, systemd: Systemd) {
    let asked = sd_notify::watchdog_enabled();
    let limit = asked.unwrap_or(LIMIT);
    let mut watched: BTreeMap<Arc<str>, WatchedRig> = BTreeMap::new();
    let mut tick = interval((limit / 8).max(Duration::from_millis(1)));
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tick.tick().await;
        let desks = desks.of(None);
        // They are sorted. One that was started again is another desk.
        let is_there = |rig: &Arc<str>, of: &WatchedRig| {
            let at = desks.binary_search_by(|(name, _)| name.cmp(rig));
            at.ok().and_then(|at| desks.get(at)).is_some_and(|(_, desk)| Arc::ptr_eq(desk, &of.desk))
        };
        watched.retain(|rig, of| is_there(rig, of));
        let mut look = |(rig, desk): &(Arc<str>, Arc<CommandDesk>)| {
            watched.entry(Arc::clone(rig)).or_insert_with(|| WatchedRig::new(desk, limit / 2)).look(rig)
        };
        let seen: Vec<_> = desks.iter().map(&mut look).collect();
        if asked.is_some()
            && let Some(message) = of_all(&seen)
        {
            systemd.tell(message);
        }
    }
}

/// What systemd is told of all rigs together, if anything.
fn of_all(rigs: &[Liveness]) -> Option<Message> {
    let hangs = |rig: &Liveness| matches!(rig, Liveness::Hangs(_) | Liveness::StillHangs(_));
    if rigs.is_empty() || !rigs.iter().all(hangs) {
        return Some(Message::Alive);
    }
    let still_hangs = |rig: &Liveness| matches!(rig, Liveness::StillHangs(_));
    rigs.iter().all(still_hangs).then_some(Message::Hangs)
}

/// A rig, as the watchdog sees it.
struct WatchedRig {
    desk: Arc<CommandDesk>,
    recorder: watch::Receiver<Gauge>,
    recorded: Changes,
    watch: Watch,
}

impl WatchedRig {
    fn new(desk: &Arc<CommandDesk>, patience: Duration) -> Self {
        let watch = Watch::new(desk.engine().clock().now().mono, patience);
        Self { desk: Arc::clone(desk), recorder: desk.recorder(), recorded: Changes::default(), watch }
    }

    /// Stops the stage of a rig that hangs.
    fn look(&mut self, rig: &str) -> Liveness {
        let engine = self.desk.engine();
        let now = engine.clock().now().mono;
        let sign = self.recorder.borrow().sign_of_life();
        let progress = Progress { recorder: self.recorded.look(sign, now), ..Progress::of(engine) };
        let liveness = self.watch.judge(progress, now);
        match liveness {
            Liveness::Alive | Liveness::StillHangs(_) => {}
            Liveness::Recovered => {
                self.desk.tell_hanging("");
                info!(rig, "every part goes on again");
            }
            Liveness::Hangs(part) => {
                self.desk.tell_hanging(part);
                error!(rig, "{part} does not go on: the stage is stopped");
                let reason = format!("{part} does not go on");
                engine.stop(StopOrder { by: "watchdog".into(), reason, abort: false });
            }
        }
        liveness
    }
}

/// When each part of the service last made progress; `None` for a part that has nothing to do.
#[derive(Debug, Clone, Copy)]
struct Progress {
    /// Acquisition with the safety supervisor.
    acquisition: Option<MonoTime>,
    /// The stage's driver.
    stage: Option<MonoTime>,
    /// The recorder's thread.
    recorder: Option<MonoTime>,
}

impl Progress {
    fn of(engine: &Engine) -> Self {
        let pulse = *engine.pulse().borrow();
        // A task that has ended makes no progress any more, whenever it last did.
        let acquisition = if engine.is_acquiring() { pulse.supervised } else { MonoTime::default() };
        let stage = (pulse.stage_driven != MonoTime::default()).then_some(pulse.stage_driven);
        Self { acquisition: Some(acquisition), stage, recorder: None }
    }
}

/// When a number last changed, as far as looks at it tell.
#[derive(Debug, Default)]
struct Changes {
    seen: Option<u64>,
    at: MonoTime,
}

impl Changes {
    /// The time of the last change; `None` while there is no number.
    fn look(&mut self, number: Option<u64>, now: MonoTime) -> Option<MonoTime> {
        if number != self.seen {
            *self = Self { seen: number, at: now };
        }
        number.map(|_| self.at)
    }
}

/// Judges the parts' progress.
#[derive(Debug)]
struct Watch {
    /// Nobody counts as hanging before this and the patience after it.
    start: MonoTime,
    looked: MonoTime,
    /// A part without progress for longer hangs.
    patience: Duration,
    hangs: bool,
}

/// What is known of the parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Liveness {
    /// All of them make progress.
    Alive,
    /// They do so again.
    Recovered,
    /// This part hangs since the last look.
    Hangs(&'static str),
    /// This part hangs still.
    StillHangs(&'static str),
}

impl Watch {
    fn new(start: MonoTime, patience: Duration) -> Self {
        Self { start, looked: start, patience, hangs: false }
    }

    fn judge(&mut self, progress: Progress, now: MonoTime) -> Liveness {
        if now.since(self.looked) > self.patience / 2 {
            // This look is late itself: the machine gave nobody time, and the parts have had none since.
            self.start = now;
        }
        self.looked = now;
        let Progress { acquisition, stage, recorder } = progress;
        let parts = [("acquisition", acquisition), ("the stage's driver", stage), ("the recorder", recorder)];
        let hanging = parts
            .into_iter()
            .find(|(_, last)| last.is_some_and(|last| now.since(last.max(self.start)) > self.patience));
        let hung = std::mem::replace(&mut self.hangs, hanging.is_some());
        match (hanging, hung) {
            (None, false) => Liveness::Alive,
            (None, true) => Liveness::Recovered,
            (Some((part, _)), false) => Liveness::Hangs(part),
            (Some((part, _)), true) => Liveness::StillHangs(part),
        }
    }
}

#[cfg(test)]
#[path = "notify_tests.rs"]
mod tests;
