//! The driver of all stages: it runs a session over a link.

use std::collections::VecDeque;
use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::time::Duration;

use futures_util::FutureExt;

use tactus_safety::{HomingPermit, Permit, Void};
use tactus_schema::{MonoTime, TimeStamp, pb};
use tactus_wire::stage::{Action, Cause, Failure, Report, Session, Status, Whereabouts};
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::{Instant, sleep, sleep_until};

use super::driven::{Connection, StageOptions};
use super::guard::{Guard, SIGN_OF_LIFE};
use super::stop::StopSwitch;
use crate::backoff::Backoff;
use crate::link::{Link, LinkEvent, since_start};
use crate::transport::Connect;
use crate::{Clock, DeviceError, ErrorKind, StageError};

/// Receives the result of a command: the position in mm.
type Reply = oneshot::Sender<Result<[f64; 3], StageError>>;

/// A command, with the channel for its result.
#[derive(Debug)]
pub(super) struct CommandRequest {
    pub(super) command: StageCommand,
    /// How often stop had been pressed when the command was given.
    pub(super) stops_before: u64,
    pub(super) reply: Reply,
}

#[derive(Debug)]
pub(super) enum StageCommand {
    Home(HomingPermit),
    MoveTo(Permit),
    Look,
    ClearAlarm,
}

/// Longest time that a moving stage may be unwatched. With the time of a status poll it is below 100 ms to the stop.
const UNWATCHED_MAX: Duration = Duration::from_millis(80);

/// Owns the stage. Reports go to `reports` and `latest`; commands come from `requests` and `stop`.
pub(super) struct Driver<S> {
    pub(super) connect: Arc<dyn Connect>,
    /// Makes the session of a connection; the error says why the configuration is invalid.
    pub(super) begin: Box<dyn Fn() -> Result<S, String> + Send + Sync>,
    pub(super) options: StageOptions,
    pub(super) clock: Clock,
    pub(super) requests: mpsc::Receiver<CommandRequest>,
    pub(super) stop: Arc<StopSwitch>,
    /// When somebody last watched the stage; `None` if nobody ever has.
    pub(super) watched: watch::Receiver<Option<Instant>>,
    pub(super) reports: mpsc::Sender<pb::StageState>,
    pub(super) latest: watch::Sender<pb::StageState>,
    pub(super) connection: watch::Sender<Connection>,
    pub(super) guard: Guard,
    pub(super) progress: Progress,
}

/// The driver's state.
#[derive(Default)]
pub(super) struct Progress {
    /// The stage answers.
    connected: bool,
    /// The command under way.
    active: Option<Active>,
    /// Reports that found no room yet. The device is not read meanwhile, so there are few.
    waiting: VecDeque<pb::StageState>,
    /// See [`pb::StageState::epoch`].
    epoch: u32,
    /// What the session of the last connection knew.
    whereabouts: Option<Whereabouts>,
    /// The kind of the present loss, once it has been logged.
    logged: Option<ErrorKind>,
}

/// The command under way.
struct Active {
    reply: Reply,
    /// Leave to move, until the first byte that sets the stage in motion.
    leave: Option<Leave>,
    /// Why that byte was not sent.
    void: Option<Void>,
    /// It was stopped because nobody watched it.
    is_abandoned: bool,
}

/// Why not all actions were carried out.
enum Unsent {
    /// The permit to move was void.
    Withheld,
    /// The link or the session failed.
    Failed(DeviceError),
}

/// Leave to move, or to home.
enum Leave {
    Home(HomingPermit),
    Move(Permit),
    /// The stage has set out: only a stop ends it now.
    Used,
}

/// The stage was dropped, so the task ends.
struct Unused;

/// How often a driver without a command gives a sign of life.
const SIGN_OF_LIFE_IDLE: Duration = Duration::from_millis(250);

impl<S: Session + Send> Driver<S>
where
    S::Error: Send + Sync,
{
    pub(super) async fn run(mut self) {
        let mut backoff = Backoff::new();
        loop {
            let connect = Arc::clone(&self.connect);
            let ended = match self.meanwhile(connect.connect()).await {
                Ok(Ok(stream)) => {
                    self.guard.open(stream.second_writer());
                    let mut link = Link::new(stream, self.clock, self.device());
                    let session = self.run_session(&mut link, &mut backoff);
                    match AssertUnwindSafe(session).catch_unwind().await {
                        Ok(ended) => ended,
                        Err(_) => Ok(self.panicked(&mut link).await),
                    }
                }
                Ok(Err(error)) => Ok(error),
                Err(Unused) => return,
            };
            self.guard.open(None);
            let Ok(error) = ended else { return };
            self.lost(error);
            if self.meanwhile(sleep(backoff.pause())).await.is_err() {
                return;
            }
        }
    }

    /// Waits for something while no stage answers. Commands fail meanwhile, and a stop has no effect.
    async fn meanwhile<T>(&mut self, awaited: impl Future<Output = T>) -> Result<T, Unused> {
        tokio::pin!(awaited);
        loop {
            self.guard.sign_of_life();
            tokio::select! {
                biased;
                () = self.stop.pressed() => {}
                () = room(&self.reports), if !self.progress.waiting.is_empty() => self.hand_over(),
                request = self.requests.recv() => match request {
                    Some(request) => answer(request.reply, Err(self.not_connected())),
                    None => return Err(Unused),
                },
                result = &mut awaited => return Ok(result),
                () = sleep(SIGN_OF_LIFE_IDLE) => {}
            }
        }
    }

    /// Runs a session over an open link until it fails; returns why.
    async fn run_session(&mut self, link: &mut Link, backoff: &mut Backoff) -> Result<DeviceError, Unused> {
        let mut session = match (self.begin)() {
            Ok(session) => session,
            Err(why) => return Ok(DeviceError::new(self.device(), ErrorKind::Protocol, why)),
        };
        if let Some(known) = self.progress.whereabouts.take() {
            session.recall(known);
        }
        let ended = self.drive(&mut session, link, backoff).await;
        self.progress.whereabouts = session.whereabouts();
        ended
    }

    /// Carries out what a session asks for, and gives it what happens, until it fails.
    async fn drive(
        &mut self,
        session: &mut S,
        link: &mut Link,
        backoff: &mut Backoff,
    ) -> Result<DeviceError, Unused> {
        let mut now = self.clock.now();
        let mut actions = session.start(since_start(now));
        // One for all signs of life: to move it to a later time costs almost nothing.
        let quiet = sleep(SIGN_OF_LIFE_IDLE);
        tokio::pin!(quiet);
        loop {
            match self.carry_out(now, actions, link, backoff).await {
                Ok(()) => {}
                Err(Unsent::Withheld) => {
                    actions = session.withhold(since_start(now));
                    continue;
                }
                Err(Unsent::Failed(error)) => return Ok(error),
            }
            self.guard.sign_of_life();
            let Progress { connected, ref active, ref waiting, .. } = self.progress;
            // During a stop, commands wait. Otherwise they are started or refused.
            let refuses_requests = !connected || (active.is_some() && !session.is_stopping());
            let takes_requests = refuses_requests || session.is_ready();
            let has_room = waiting.is_empty();
            // A look moves nothing.
            let motion = active.as_ref().filter(|active| active.leave.is_some());
            let is_watched = motion.is_some_and(|motion| !motion.is_abandoned);
            let is_guarded = motion.is_some() && self.guard.is_guarding();
            let sign_of_life = if is_guarded { SIGN_OF_LIFE } else { SIGN_OF_LIFE_IDLE };
            quiet.as_mut().reset(Instant::now() + sign_of_life);
            actions = tokio::select! {
                biased;
                () = self.stop.pressed() => {
                    now = self.clock.now();
                    session.stop(since_start(now))
                }
                () = unwatched(&mut self.watched), if is_watched => {
                    tracing::error!(device = self.device(), "nobody watches the stage: it is stopped");
                    now = self.abandon();
                    session.stop(since_start(now))
                }
                () = room(&self.reports), if !has_room => {
                    self.hand_over();
                    Vec::new()
                }
                request = self.requests.recv(), if has_room && takes_requests => {
                    let Some(request) = request else { return Err(Unused) };
                    now = self.clock.now();
                    self.begin(now, request, session)
                }
                event = link.next(session.deadline()), if has_room => match event {
                    Ok((stamp, LinkEvent::Received(bytes))) => {
                        now = stamp;
                        session.receive(since_start(now), bytes)
                    }
                    Ok((stamp, LinkEvent::Deadline)) => {
                        now = stamp;
                        session.timer(since_start(now))
                    }
                    Err(error) => return Ok(error),
                },
                () = &mut quiet => Vec::new(),
            };
            if self.guard.has_fired() {
                now = self.abandon();
                actions.extend(session.stop(since_start(now)));
            }
        }
    }

    /// Notes that the command under way is stopped because nobody watched it.
    fn abandon(&mut self) -> TimeStamp {
        if let Some(active) = &mut self.progress.active {
            active.is_abandoned = true;
        }
        self.clock.now()
    }

    /// After a panic of the session: stops what it did, and has the link opened anew.
    async fn panicked(&mut self, link: &mut Link) -> DeviceError {
        if let Some(halt) = self.guard.halt()
            && let Err(error) = link.send(&halt).await
        {
            tracing::error!(%error, "the stop cannot be written");
        }
        let what = "its driver panicked, and the stage was stopped; this is a defect of Tactus: see the log";
        DeviceError::new(self.device(), ErrorKind::Protocol, what)
    }

    /// Begins a command, or answers why not.
    fn begin(&mut self, now: TimeStamp, request: CommandRequest, session: &mut S) -> Vec<Action<S::Error>> {
        let CommandRequest { command, stops_before, reply } = request;
        let refusal = if !self.progress.connected {
            self.not_connected()
        } else if self.progress.active.is_some() {
            let reason = "another command is under way".to_owned();
            StageError::Refused { command: format!("{command:?}"), reason }
        } else if stops_before != self.stop.count() {
            StageError::Stopped { position_mm: self.position_mm() }
        } else if let Err(void) = command.check(now.mono) {
            void.into()
        } else if command.is_motion()
            && let Err(error) = self.guard.ready(!self.options.simulated)
        {
            let reason = format!("no thread can guard it: {error}");
            StageError::Refused { command: format!("{command:?}"), reason }
        } else {
            let now = since_start(now);
            let (leave, actions) = match command {
                StageCommand::Home(permit) => (Some(Leave::Home(permit)), session.home(now)),
                StageCommand::MoveTo(permit) => {
                    let target = permit.target();
                    let actions = session.move_to(now, target.position_mm, target.speed_mm_per_s);
                    (Some(Leave::Move(permit)), actions)
                }
                StageCommand::Look => (None, session.look(now)),
                StageCommand::ClearAlarm => (None, session.clear_alarm(now)),
            };
            if leave.is_some() {
                self.guard.begin(session.halt());
            }
            self.progress.active = Some(Active { reply, leave, void: None, is_abandoned: false });
            return actions;
        };
        answer(reply, Err(refusal));
        Vec::new()
    }

    async fn carry_out(
        &mut self,
        now: TimeStamp,
        actions: Vec<Action<S::Error>>,
        link: &mut Link,
        backoff: &mut Backoff,
    ) -> Result<(), Unsent> {
        let mut is_withheld = false;
        for action in actions {
            match action {
                Action::Send(bytes) => link.send(&bytes).await?,
                // Checked now: since the command began, the controller may have been asked this and that.
                Action::Move(bytes) => match self.check_leave() {
                    Ok(()) => link.send(&bytes).await?,
                    Err(void) => {
                        tracing::debug!(device = self.device(), %void, "a motion is withheld");
                        is_withheld = true;
                    }
                },
                Action::Connected(controller) => {
                    tracing::info!(
                        device = self.device(),
                        controller = controller.identity,
                        "stage connected"
                    );
                    backoff.reset();
                    self.progress.logged = None;
                    self.progress.connected = true;
                    self.progress.epoch += 1;
                    self.connection.send_replace(Connection::Connected(controller));
                }
                Action::Report(report) => self.report(now, report),
                Action::Suspect { why } => {
                    self.progress.epoch += 1;
                    tracing::warn!(device = self.device(), why, "the stage's position is suspect");
                }
                Action::Done(result) => {
                    self.guard.end();
                    if let Some(active) = self.progress.active.take() {
                        let result = result.map_err(|failure| stage_error(failure, &active));
                        answer(active.reply, result);
                    }
                }
                Action::Failed(error) => return Err(self.describe(&error).into()),
            }
        }
        if is_withheld { Err(Unsent::Withheld) } else { Ok(()) }
    }

    /// Checks, just before the first byte that sets the stage in motion, that the command still may.
    fn check_leave(&mut self) -> Result<(), Void> {
        let now = self.clock.now().mono;
        let Some(active) = &mut self.progress.active else { return Err(Void::Revoked) };
        let checked = match &active.leave {
            Some(Leave::Home(permit)) => permit.check(now),
            Some(Leave::Move(permit)) => permit.check(now),
            Some(Leave::Used) => return Ok(()),
            None => Err(Void::Revoked),
        };
        match checked {
            Ok(()) => active.leave = Some(Leave::Used),
            Err(void) => active.void = Some(void),
        }
        checked
    }

    /// Publishes a report of a stage that is connected. What one says while it is greeted is not told: whether it knows its place is not known yet.
    fn report(&mut self, now: TimeStamp, report: Report) {
        if !self.progress.connected {
            return;
        }
        let status = match report.status {
            Status::Unhomed => pb::StageStatus::Unhomed,
            Status::Idle => pb::StageStatus::Idle,
            Status::Moving => pb::StageStatus::Moving,
            Status::Hold => pb::StageStatus::Hold,
            Status::Homing => pb::StageStatus::Homing,
            Status::Alarm => pb::StageStatus::Alarm,
        };
        self.publish(now, report.position_mm, status, report.alarm.map(|alarm| alarm.code.into()));
    }

    fn publish(
        &mut self,
        now: TimeStamp,
        [x_mm, y_mm, z_mm]: [f64; 3],
        status: pb::StageStatus,
        alarm: Option<u32>,
    ) {
        let before = *self.latest.borrow();
        if before.status() != status {
            let is_routine = |status| matches!(status, pb::StageStatus::Idle | pb::StageStatus::Moving);
            if is_routine(before.status()) && is_routine(status) {
                tracing::debug!(device = self.device(), to = ?status, "stage");
            } else {
                tracing::info!(device = self.device(), from = ?before.status(), to = ?status, alarm, "stage");
            }
        }
        if before.status() != status && is_doubtful(status) {
            self.progress.epoch += 1;
        }
        let state = pb::StageState {
            seq: before.seq + 1,
            t_mono_ns: now.mono.ns(),
            t_wall_ns: now.wall.ns(),
            x_mm,
            y_mm,
            z_mm,
            status: status.into(),
            alarm,
            simulated: self.options.simulated,
            epoch: self.progress.epoch,
        };
        self.latest.send_replace(state);
        self.progress.waiting.push_back(state);
        // At once if possible, so that a report arrives before the result that depends on it.
        self.hand_over();
    }

    /// Sends the reports for which there is room. Without a receiver they are dropped.
    fn hand_over(&mut self) {
        while let Some(report) = self.progress.waiting.pop_front() {
            if let Err(TrySendError::Full(report)) = self.reports.try_send(report) {
                self.progress.waiting.push_front(report);
                return;
            }
        }
    }

    /// The link failed, so the command under way fails, too.
    fn lost(&mut self, error: DeviceError) {
        if self.progress.logged != Some(error.kind) {
            tracing::warn!(%error, kind = ?error.kind, "stage lost");
            self.progress.logged = Some(error.kind);
        }
        self.progress.connected = false;
        if let Some(Active { reply, .. }) = self.progress.active.take() {
            answer(reply, Err(DeviceError::new(&error.device, error.kind, &error.what).into()));
        }
        self.connection.send_replace(Connection::Seeking(Some(Arc::new(error))));
        if self.latest.borrow().status() != pb::StageStatus::Disconnected {
            self.publish(self.clock.now(), self.position_mm(), pb::StageStatus::Disconnected, None);
        }
    }

    fn position_mm(&self) -> [f64; 3] {
        let state = self.latest.borrow();
        [state.x_mm, state.y_mm, state.z_mm]
    }

    fn device(&self) -> String {
        format!("stage on {}", self.connect)
    }

    /// The error of a command while no stage answers, with the cause if it is known.
    fn not_connected(&self) -> StageError {
        let what = "it is not connected; it is being looked for";
        let error = match &*self.connection.borrow() {
            Connection::Seeking(Some(why)) => {
                DeviceError::new(self.device(), why.kind, format!("{what}: {}", why.what))
            }
            Connection::Seeking(None) | Connection::Connected(_) => {
                DeviceError::new(self.device(), ErrorKind::Disconnected, what)
            }
        };
        error.into()
    }

    fn describe(&self, error: &S::Error) -> DeviceError {
        let kind = match S::cause(error) {
            Cause::Silent => ErrorKind::Timeout,
            Cause::Protocol => ErrorKind::Protocol,
            Cause::Mismatch => ErrorKind::DeviceFault,
        };
        DeviceError::new(self.device(), kind, error.to_string())
    }
}

/// True for a status after which the position is not the one before.
fn is_doubtful(status: pb::StageStatus) -> bool {
    match status {
        pb::StageStatus::Unspecified
        | pb::StageStatus::Disconnected
        | pb::StageStatus::Unhomed
        | pb::StageStatus::Homing
        | pb::StageStatus::Alarm => true,
        pb::StageStatus::Idle | pb::StageStatus::Moving | pb::StageStatus::Hold => false,
    }
}

fn stage_error(failure: Failure, active: &Active) -> StageError {
    match failure {
        Failure::Stopped { position_mm } if active.is_abandoned => StageError::Unwatched { position_mm },
        Failure::Withheld => active.void.unwrap_or(Void::Revoked).into(),
        Failure::Stopped { position_mm } => StageError::Stopped { position_mm },
        Failure::Refused { command, reason } => StageError::Refused { command, reason },
        Failure::Unanswered { command, waited } => {
            StageError::Unanswered { command, waited_s: waited.as_secs_f64() }
        }
        Failure::Alarm(alarm) => StageError::Alarm {
            code: alarm.code.into(),
            name: alarm.name(),
            meaning: alarm.meaning.to_owned(),
        },
        Failure::Unhomed => StageError::Unhomed,
        Failure::Interrupted { axis, meaning, position_mm } => {
            StageError::Interrupted { axis: axis.to_string(), meaning: meaning.to_owned(), position_mm }
        }
        Failure::NotIdle { position_mm } => StageError::NotIdle { position_mm },
        Failure::NotThere { target_mm, position_mm } => StageError::NotThere { target_mm, position_mm },
        Failure::Astray { target_mm, position_mm } => StageError::Astray { target_mm, position_mm },
        Failure::Overdue { target_mm, position_mm, waited } => {
            StageError::Overdue { target_mm, position_mm, waited_s: waited.as_secs_f64() }
        }
    }
}

impl From<DeviceError> for Unsent {
    fn from(error: DeviceError) -> Self {
        Self::Failed(error)
    }
}

impl StageCommand {
    const fn is_motion(&self) -> bool {
        match self {
            Self::Home(_) | Self::MoveTo(_) => true,
            Self::Look | Self::ClearAlarm => false,
        }
    }

    /// Checks that the command may still be sent.
    fn check(&self, now: MonoTime) -> Result<(), Void> {
        match self {
            Self::Home(permit) => permit.check(now),
            Self::MoveTo(permit) => permit.check(now),
            Self::Look | Self::ClearAlarm => Ok(()),
        }
    }
}

/// Returns once nobody has watched the stage for too long. Never, if nobody ever has.
async fn unwatched(watched: &mut watch::Receiver<Option<Instant>>) {
    loop {
        let last = *watched.borrow_and_update();
        let overdue = async {
            match last {
                Some(last) => sleep_until(last + UNWATCHED_MAX).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            biased;
            Ok(()) = watched.changed() => {}
            () = overdue => return,
        }
    }
}

fn answer(reply: Reply, result: Result<[f64; 3], StageError>) {
    if let Err(result) = reply.send(result) {
        tracing::debug!(?result, "nobody waits for the result of a command any more");
    }
}

/// Waits until there is room for a report, or no receiver is left.
async fn room(reports: &mpsc::Sender<pb::StageState>) {
    drop(reports.reserve().await);
}
