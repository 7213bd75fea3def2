//! Answers the commands on the bus.

use std::fmt;
use std::fs::File;
use std::io::{self, Read as _};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tactus_bus::{CommandCall, Publisher, Request};
use tactus_engine::{Engine, ResetError, ResumeError, RunOrder, StopOrder};
use tactus_plan::{Arguments, Evaluate, Script};
use tactus_runner::config::RigFiles;
use tactus_runner::continuation::{self, ContinuationError, Wish};
use tactus_runner::order::{self, RunRequest};
use tactus_runner::recorder::{Gauge, ThreadRecorder};
use tactus_runner::twin::{Attend, DryRun, SoFar};
use tactus_runner::{experiments, twin};
use tactus_schema::key::Command;
use tactus_schema::{MonoTime, Rig, WallTime, pb};
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::time::timeout;
use tracing::{Instrument as _, Span, field, info, info_span, warn};

use super::catalogue;
use super::description::describe;
use super::health::health;
use super::lease::{Lease, Secret};

/// The CLI's exit codes for a failed command.
mod exit {
    pub(super) const FAILED: u32 = 1;
    pub(super) const USAGE: u32 = 2;
    pub(super) const REFUSED: u32 = 4;
    pub(super) const NOT_NOW: u32 = 5;
}

/// Longest time in which a resumed run goes on.
const RESUME_PATIENCE: Duration = Duration::from_secs(2);

/// Where the runs of a rig come from and go to.
#[derive(Debug, Clone)]
pub(super) struct Places {
    /// The rig's files: their texts go into recordings.
    pub(super) files: Arc<RigFiles>,
    /// Folder of its recordings.
    pub(super) recordings: PathBuf,
    /// Folder of experiment scripts.
    pub(super) experiments: Option<PathBuf>,
}

/// Answers commands for one engine.
pub(crate) struct CommandDesk {
    engine: Engine,
    places: Places,
    publisher: Publisher,
    lease: Mutex<Lease>,
    /// Of the last run.
    recorder: watch::Sender<Gauge>,
    evaluator: Arc<dyn Evaluate>,
    /// Counts the requests for a plan: the newest ends the others.
    plans: Arc<AtomicU64>,
    /// One list of experiments at a time: each script has a process for a moment.
    listing: Arc<Semaphore>,
    /// The part of the rig that does not go on; empty if all do.
    hanging: Mutex<&'static str>,
}

/// What a client wants to run.
enum Wanted {
    Experiment(Box<RunRequest>),
    /// What is left of an earlier run.
    Rest {
        run_id: String,
        who: String,
        evaluator: Arc<dyn Evaluate>,
        /// Folder of the recordings.
        recordings: PathBuf,
        /// Folder of scripts.
        experiments: Option<PathBuf>,
    },
}

/// A run that can begin.
struct Prepared {
    order: RunOrder,
    plan: DryRun,
    /// What who asks should know; may be empty.
    note: String,
}

/// Why a command was not done.
#[derive(Debug)]
struct Refusal {
    exit_code: u32,
    error: String,
}

impl CommandDesk {
    pub(super) fn new(
        engine: Engine,
        places: Places,
        publisher: Publisher,
        evaluator: Arc<dyn Evaluate>,
    ) -> Self {
        let recorder = watch::Sender::default();
        let (plans, listing) = (Arc::default(), Arc::new(Semaphore::new(1)));
        let (lease, hanging) = (Mutex::default(), Mutex::default());
        Self { engine, places, publisher, lease, recorder, evaluator, plans, listing, hanging }
    }

    /// The engine that it commands.
    pub(crate) fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The watchdog tells which part does not go on; empty if all do.
    pub(crate) fn tell_hanging(&self, part: &'static str) {
        *self.hanging.lock().unwrap_or_else(PoisonError::into_inner) = part;
    }

    /// What the recorder of the last run shows. Each run has a recorder of its own: an old one may still wait for its disk.
    pub(crate) fn recorder(&self) -> watch::Receiver<Gauge> {
        self.recorder.subscribe()
    }

    /// Stops motion. Wants no lease and never waits.
    pub(super) fn stop(&self, request: &Request) {
        let order = match request.clone() {
            Request::Control(request) => {
                StopOrder { by: request.who, reason: request.reason, abort: request.abort }
            }
            Request::Run(_) | Request::Lease(_) => {
                StopOrder { by: "unknown".into(), reason: String::new(), abort: false }
            }
        };
        let was_running = self.engine.stop(order.clone());
        warn!(by = order.by, reason = order.reason, was_running, "stop");
    }

    /// The answer to a stop.
    pub(super) fn stopped(&self) -> pb::CommandReply {
        self.reply(Ok(()))
    }

    /// Answers until the channel is closed.
    pub(super) async fn answer_commands(self: &Arc<Self>, commands: &mut mpsc::Receiver<Box<CommandCall>>) {
        while let Some(call) = commands.recv().await {
            let call = *call;
            match (call.command, call.request) {
                (Command::Run, Request::Run(request)) => {
                    // A dry run takes a while: other commands are answered meanwhile.
                    let desk = Arc::clone(self);
                    let span = info_span!("command run", by = request.who, refused = field::Empty);
                    let run = async move {
                        let reply = match desk.run(request).await {
                            Ok(note) => pb::CommandReply { note, ..desk.reply(Ok(())) },
                            Err(refusal) => {
                                Span::current().record("refused", &refusal.error);
                                desk.reply(Err(refusal))
                            }
                        };
                        call.reply.reply(reply);
                    };
                    tokio::spawn(run.instrument(span));
                }
                (Command::Reset, Request::Control(request)) => {
                    // Homing takes a while.
                    let desk = Arc::clone(self);
                    let span = info_span!("command reset", by = request.who);
                    let reset = async move {
                        let done = desk.reset(&request).await;
                        call.reply.reply(desk.reply(done));
                    };
                    tokio::spawn(reset.instrument(span));
                }
                (Command::Lease, Request::Lease(request)) => {
                    let reply = match self.change_lease(&request) {
                        Ok(lease) => pb::CommandReply { lease: Some(lease), ..self.reply(Ok(())) },
                        Err(refusal) => self.reply(Err(refusal)),
                    };
                    call.reply.reply(reply);
                }
                (Command::Pause, Request::Control(request)) => {
                    call.reply.reply(self.reply(self.pause(&request)));
                }
                (Command::Resume, Request::Control(request)) => {
                    let desk = Arc::clone(self);
                    tokio::spawn(async move {
                        let done = desk.resume(&request).await;
                        call.reply.reply(desk.reply(done));
                    });
                }
                (Command::Status, Request::Control(_)) => {
                    let rig_toml = self.places.files.texts.rig_toml.clone();
                    let description = describe(&self.engine.rig());
                    let recordings = self.places.recordings.display().to_string();
                    let reply = self.reply(Ok(()));
                    call.reply.reply(pb::CommandReply { rig_toml, description, recordings, ..reply });
                }
                (Command::Experiments, Request::Control(_)) => {
                    let desk = Arc::clone(self);
                    tokio::spawn(async move {
                        let reply = match desk.experiments().await {
                            Ok(experiments) => pb::CommandReply { experiments, ..desk.reply(Ok(())) },
                            Err(refusal) => desk.reply(Err(refusal)),
                        };
                        call.reply.reply(reply);
                    });
                }
                (Command::Plan, Request::Run(request)) => {
                    let desk = Arc::clone(self);
                    tokio::spawn(async move {
                        let reply = match desk.plan(request).await {
                            Ok(plan) => pb::CommandReply { plan: Some(plan), ..desk.reply(Ok(())) },
                            Err(refusal) => desk.reply(Err(refusal)),
                        };
                        call.reply.reply(reply);
                    });
                }
                // The bus decodes each command's own request, and gives stops to their own channel.
                (command, request) => {
                    warn!(?command, ?request, "a command with another command's request");
                    let error = "this is another command's request";
                    call.reply.reply(self.reply(Err(Refusal::usage(error))));
                }
            }
        }
    }

    fn pause(&self, request: &pb::CommandRequest) -> Result<(), Refusal> {
        self.want_lease(&request.lease)?;
        info!(by = request.who, "pause");
        if self.engine.pause(&request.who) { Ok(()) } else { Err(Refusal::failed("no run is in progress")) }
    }

    /// Returns when the run goes on, so that the answer's state is the new one.
    async fn resume(&self, request: &pb::CommandRequest) -> Result<(), Refusal> {
        self.want_lease(&request.lease)?;
        info!(by = request.who, "resume");
        let mut state = self.engine.state();
        self.engine.resume(&request.who, request.covering_mm).map_err(|error| match error {
            ResumeError::NotPaused => Refusal::failed(error),
            ResumeError::CoveringNotConfirmed { .. } => Refusal::usage(error),
        })?;
        let goes_on = state.wait_for(|state| state.phase() != pb::RunPhase::Paused);
        // Somebody may have paused it again: then the state says so.
        let _went_on = timeout(RESUME_PATIENCE, goes_on).await;
        Ok(())
    }

    /// Refuses a command of a client that does not hold the lease.
    fn want_lease(&self, lease: &[u8]) -> Result<(), Refusal> {
        let now = self.engine.clock().now().mono;
        self.lease().check(lease, now).map_err(Refusal::not_now)
    }

    /// Gives, keeps or ends the lease. Who takes it gets its secret.
    fn change_lease(&self, request: &pb::LeaseRequest) -> Result<pb::Lease, Refusal> {
        let now = self.engine.clock().now().mono;
        let who = &request.who;
        let mut given = Vec::new();
        let mut lease = self.lease();
        match request.action() {
            pb::LeaseAction::Acquire => {
                let secret = new_secret()?;
                lease.acquire(who, secret, now).map_err(Refusal::not_now)?;
                given = secret.0.to_vec();
            }
            pb::LeaseAction::TakeOver => {
                if request.reason.trim().is_empty() {
                    return Err(Refusal::usage("who takes the lease over says why"));
                }
                let secret = new_secret()?;
                if let Some(from) = lease.take_over(who, secret, now) {
                    self.record_takeover(pb::LeaseTaken {
                        by: who.clone(),
                        from,
                        reason: request.reason.clone(),
                    });
                }
                given = secret.0.to_vec();
            }
            pb::LeaseAction::Renew => lease.renew(&request.lease, now).map_err(Refusal::not_now)?,
            pb::LeaseAction::Release => lease.release(&request.lease, now).map_err(Refusal::not_now)?,
            pb::LeaseAction::Unspecified => {
                return Err(Refusal::usage("what to do with the lease is missing"));
            }
        }
        Ok(pb::Lease { lease: given, ..told(&lease, now) })
    }

    /// Tells and records a takeover: who, from whom and why.
    fn record_takeover(&self, taken: pb::LeaseTaken) {
        warn!(by = taken.by, from = taken.from, reason = taken.reason, "the lease is taken over");
        self.engine.record_takeover(taken);
    }

    fn lease(&self) -> MutexGuard<'_, Lease> {
        // Nothing panics under this lock.
        self.lease.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Who holds the lease now; empty if nobody does.
    pub(super) fn holder(&self) -> String {
        let now = self.engine.clock().now().mono;
        self.lease().holder(now).map(|(holder, _)| holder.to_owned()).unwrap_or_default()
    }

    /// The present health; the frame rate is over the time since `before`.
    pub(super) fn health(&self, before: (u64, MonoTime)) -> pb::Health {
        let hanging = *self.hanging.lock().unwrap_or_else(PoisonError::into_inner);
        let health = health(&self.engine, &self.publisher, before, self.holder());
        if hanging.is_empty() {
            return health;
        }
        let problem = format!("{hanging} does not go on: this is a defect of Tactus; restart the service");
        pb::Health { problem, ..health }
    }

    async fn reset(&self, request: &pb::CommandRequest) -> Result<(), Refusal> {
        self.want_lease(&request.lease)?;
        info!(by = request.who, "reset: clearing the stage's alarm and homing");
        self.engine.reset().await.map_err(|error| match error {
            ResetError::Busy(busy) => Refusal::not_now(busy),
            ResetError::Stopped(_) | ResetError::Stage(_) | ResetError::NotReady(_) => Refusal::failed(error),
        })
    }

    /// Checks the request, dry-runs it, and starts the run. Returns what who asks should know besides.
    async fn run(&self, request: pb::RunRequest) -> Result<String, Refusal> {
        self.want_lease(&request.lease)?;
        let lease = request.lease.clone();
        // From here on a stop ends this run, even before the dry run is over.
        let claim = self.engine.claim().map_err(Refusal::not_now)?;
        if let Some(fault) = self.engine.fault() {
            return Err(Refusal::refused(format!(
                "{fault}: see that the tip is free to move, then `tactus reset`"
            )));
        }
        let wanted = self.wanted(request)?;
        let rig = self.engine.rig();
        let now = self.engine.clock().now().wall;
        let twin_rig = rig.clone();
        let span = info_span!("dry run");
        let prepare = move || {
            let _entered = span.entered();
            let began = Instant::now();
            let tell = |order: &RunOrder, so_far: SoFar| {
                // Most dry runs are over before anybody could wonder.
                let Some(share) = so_far.share.filter(|share| *share > 0.0) else { return };
                let elapsed_s = began.elapsed().as_secs_f64();
                let times_s = [elapsed_s, elapsed_s * (1.0 - share) / share];
                claim.prepares(&order.run_id, order.script.name(), so_far.presses, times_s);
            };
            let prepared = prepare(wanted, &twin_rig, now, &|| claim.check().is_err(), &tell);
            (claim, prepared)
        };
        let (claim, prepared) = tokio::task::spawn_blocking(prepare).await.map_err(Refusal::failed)?;
        // What a stop has broken off is told as stopped, not as impossible.
        claim.check().map_err(Refusal::failed)?;
        let Prepared { mut order, plan, note } = prepared?;
        if !plan.is_possible() {
            let refused = plan.outcome.exit_status == pb::ExitStatus::Refused;
            let exit_code = if refused { exit::REFUSED } else { exit::FAILED };
            return Err(Refusal { exit_code, error: plan.outcome.message });
        }
        // Somebody may have taken it over during the dry run.
        self.want_lease(&lease)?;
        order.planned = Some(plan.promise());
        let texts = self.places.files.texts.all();
        let (recording, path) =
            order::recording(&order, &rig, texts, &self.places.recordings, now).map_err(Refusal::failed)?;
        let path = std::path::absolute(&path).unwrap_or(path);
        info!(run = order.run_id, recording = %path.display(), presses = plan.promise().presses, "run accepted");
        let gauge = Gauge::default();
        let record = ThreadRecorder::start_with(recording, gauge.clone()).map_err(Refusal::failed)?;
        self.recorder.send_replace(gauge);
        order.recording = path.display().to_string();
        let run_id = order.run_id.clone();
        tokio::spawn(claim.run(order, Box::new(record)).in_current_span());
        // The answer contains the state of this run, not of the previous one.
        self.engine.state().wait_for(|state| state.run_id == run_id).await.map_err(Refusal::failed)?;
        Ok(note)
    }

    /// The experiments that are known by name.
    async fn experiments(&self) -> Result<Vec<pb::Experiment>, Refusal> {
        let (rig, folder) = (self.engine.rig(), self.places.experiments.clone());
        let evaluator = Arc::clone(&self.evaluator);
        let listing = Arc::clone(&self.listing).try_acquire_owned();
        let listing = listing.map_err(|_| Refusal::not_now("the experiments are being listed: ask again"))?;
        let list = move || {
            let list = catalogue::list(folder.as_deref(), &rig, &*evaluator);
            drop(listing);
            list
        };
        tokio::task::spawn_blocking(list).await.map_err(Refusal::failed)
    }

    /// Makes the dry run of a request and no more. A newer request ends it.
    async fn plan(&self, request: pb::RunRequest) -> Result<pb::Plan, Refusal> {
        let number = self.plans.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
        let plans = Arc::clone(&self.plans);
        let is_old = move || plans.load(Ordering::Relaxed) != number;
        let wanted = self.wanted(request)?;
        let rig = self.engine.rig();
        let now = self.engine.clock().now().wall;
        let depth_max_mm = rig.depth_max_mm().unwrap_or_default();
        let prepare = {
            let is_old = is_old.clone();
            // Who asks waits for the answer alone.
            move || prepare(wanted, &rig, now, &is_old, &|_, _| ())
        };
        let prepared = tokio::task::spawn_blocking(prepare).await.map_err(Refusal::failed)?;
        if is_old() {
            return Err(Refusal::not_now("a newer dry run has ended this one"));
        }
        let Prepared { order, plan, .. } = prepared?;
        let outcome = &plan.outcome;
        let travel_mm: Vec<_> = outcome.travel_mm.iter().flatten().copied().collect();
        let moves = travel_mm.iter().all(|bound_mm| bound_mm.is_finite());
        Ok(pb::Plan {
            exit_status: outcome.exit_status.into(),
            message: if plan.is_possible() { String::new() } else { outcome.message.clone() },
            presses: outcome.presses,
            dwells: outcome.dwells,
            duration_s: outcome.duration_s,
            deepest_mm: if moves { plan.deepest_mm() } else { 0.0 },
            depth_max_mm,
            travel_mm: if moves { travel_mm } else { Vec::new() },
            seed: order.seed,
            parameters_json: order.arguments.to_json(),
        })
    }

    /// Checks the form of a request.
    fn wanted(&self, request: pb::RunRequest) -> Result<Wanted, Refusal> {
        let evaluator = Arc::clone(&self.evaluator);
        let experiments = self.places.experiments.clone();
        if request.continue_run.is_empty() {
            let script = self.script(&request)?;
            let arguments = Arguments::from_json(&request.parameters_json).map_err(Refusal::usage)?;
            let pb::RunRequest { seed, who, .. } = request;
            let request = RunRequest { script, arguments, seed, who, evaluator, earlier: None };
            return Ok(Wanted::Experiment(Box::new(request)));
        }
        let pb::RunRequest { experiment, script, parameters_json, seed, who, continue_run: run_id, .. } =
            request;
        if !experiment.is_empty() || !script.is_empty() || !parameters_json.is_empty() || seed.is_some() {
            let error =
                "a run that goes on with an earlier one has its script, parameters and seed: leave them out";
            return Err(Refusal::usage(error));
        }
        let recordings = self.places.recordings.clone();
        Ok(Wanted::Rest { run_id, who, evaluator, recordings, experiments })
    }

    fn script(&self, request: &pb::RunRequest) -> Result<Script, Refusal> {
        if request.script.is_empty() {
            experiments::named(&request.experiment, self.places.experiments.as_deref())
                .map_err(Refusal::usage)
        } else {
            Script::parse(&request.experiment, &request.script).map_err(Refusal::usage)
        }
    }

    fn reply(&self, done: Result<(), Refusal>) -> pb::CommandReply {
        let (ok, error, exit_code) = match done {
            Ok(()) => (true, String::new(), 0),
            Err(Refusal { exit_code, error }) => (false, error, exit_code),
        };
        let rig = self.engine.rig();
        pb::CommandReply {
            ok,
            error,
            exit_code,
            state: Some(self.engine.run_state()),
            rig: rig.name.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            stage: Some(self.engine.stage_state()),
            health: Some(self.health((0, MonoTime::default()))),
            lease: Some(told(&self.lease(), self.engine.clock().now().mono)),
            note: String::new(),
            rig_toml: String::new(),
            covering_mm: rig.covering.thickness_mm,
            depth_max_mm: rig.depth_max_mm().unwrap_or_default(),
            safety: self.engine.safety(),
            ..Default::default()
        }
    }
}

/// Who holds the lease, as everybody may know it.
fn told(lease: &Lease, now: MonoTime) -> pb::Lease {
    let (holder, left) = lease.holder(now).unwrap_or_default();
    pb::Lease { holder: holder.to_owned(), expires_in_s: left.as_secs_f64(), lease: Vec::new() }
}

fn new_secret() -> Result<Secret, Refusal> {
    let mut bytes = [0; 16];
    let read = File::open("/dev/urandom").and_then(|mut random| random.read_exact(&mut bytes));
    read.map(|()| Secret(bytes))
        .map_err(|error: io::Error| Refusal::failed(format!("the system gives no random numbers: {error}")))
}

/// Who waits for the dry run of an order.
struct Preparation<'a> {
    order: &'a RunOrder,
    stopped: &'a dyn Fn() -> bool,
    tell: &'a dyn Fn(&RunOrder, SoFar),
}

impl Attend for Preparation<'_> {
    fn stops(&self) -> bool {
        (self.stopped)()
    }

    fn sees(&self, so_far: SoFar) {
        (self.tell)(self.order, so_far);
    }
}

/// Reads the earlier run if there is one, checks the parameters and makes the dry run, until `stopped`.
fn prepare(
    wanted: Wanted,
    rig: &Rig,
    now: WallTime,
    stopped: &dyn Fn() -> bool,
    tell: &dyn Fn(&RunOrder, SoFar),
) -> Result<Prepared, Refusal> {
    let (request, note) = match wanted {
        Wanted::Experiment(request) => (*request, None),
        Wanted::Rest { run_id, who, evaluator, recordings, experiments } => {
            info!(who, run_id, "an earlier run is read, to go on with it");
            let wish = Wish { run_id: &run_id, folder: &recordings, who, evaluator };
            let continuation = continuation::of_run(wish, rig, stopped)?;
            let present = experiments::named(continuation.request.script.name(), experiments.as_deref());
            let note = continuation.note(present.as_ref().ok());
            (continuation.request, note)
        }
    };
    info!(who = request.who, "the dry run begins");
    let order = order::order(request, rig, now, stopped).map_err(Refusal::usage)?;
    let preparation = Preparation { order: &order, stopped, tell };
    let plan = twin::dry_run(rig, order.clone(), &preparation).map_err(Refusal::failed)?;
    if let Some(note) = &note {
        info!("{note}");
    }
    Ok(Prepared { order, plan, note: note.unwrap_or_default() })
}

impl From<ContinuationError> for Refusal {
    fn from(error: ContinuationError) -> Self {
        match error {
            ContinuationError::Unknown { .. }
            | ContinuationError::Done { .. }
            | ContinuationError::Aborted { .. }
            | ContinuationError::Script(_) => Self::usage(error),
            ContinuationError::OtherRig { .. } => Self::refused(error),
            ContinuationError::Open { .. } => Self::not_now(error),
            ContinuationError::Record(_)
            | ContinuationError::Lacks { .. }
            | ContinuationError::Rig { .. }
            | ContinuationError::TooLong { .. }
            | ContinuationError::Stopped => Self::failed(error),
        }
    }
}

impl Refusal {
    fn failed(error: impl fmt::Display) -> Self {
        Self { exit_code: exit::FAILED, error: format!("{error}") }
    }

    fn not_now(error: impl fmt::Display) -> Self {
        Self { exit_code: exit::NOT_NOW, error: format!("{error}") }
    }

    fn refused(error: impl fmt::Display) -> Self {
        Self { exit_code: exit::REFUSED, error: format!("{error}") }
    }

    fn usage(error: impl fmt::Display) -> Self {
        Self { exit_code: exit::USAGE, error: format!("{error}") }
    }
}

#[cfg(test)]
#[path = "commands_tests.rs"]
mod tests;
