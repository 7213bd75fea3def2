//! The engine owns the devices for the life of the service and executes at most one run at a time.

use std::fmt;
use std::io;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tactus_device::{Clock, Sensor, Stage, StageError};
use tactus_model::Covering;
use tactus_safety::{Fault, Revocation, Supervisor};
use tactus_schema::rig::Service;
use tactus_schema::{MonoTime, Rig, pb};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;
use tracing::{Instrument as _, field, info_span};

use crate::acquisition::{Gone, Mailbox, acquire, mailbox};
use crate::motion::WayUp;
use crate::outlet::{Publish, Record};
use crate::run::{Broken, Ending, Run, RunOrder, RunOutcome, rescue};

/// Puts a covering of a thickness in mm in place. Only a simulated rig has such a function.
pub type ChangeCovering = Arc<dyn Fn(f64) + Send + Sync>;

/// Remembers the covering in place beyond the end of the service.
pub trait CoveringMemory: Send + Sync {
    /// Thickness of the covering that was last confirmed, in mm; `None` if none ever was.
    ///
    /// # Errors
    /// If it cannot be read.
    fn recall(&self) -> io::Result<Option<f64>>;

    /// Remembers the thickness, in mm. Returns once it is on disk.
    ///
    /// # Errors
    /// If it cannot be stored.
    fn remember(&self, thickness_mm: f64) -> io::Result<()>;
}

/// A rig's devices, started.
pub struct Devices {
    /// The tactile array.
    pub sensor: Box<dyn Sensor>,
    /// The indentation stage.
    pub stage: Arc<dyn Stage>,
    /// Every report of the stage.
    pub stage_reports: mpsc::Receiver<pb::StageState>,
    /// Changes the covering; `None` if a person changes it.
    pub change_covering: Option<ChangeCovering>,
    /// Where the covering in place is kept; `None` if nothing outlives the engine, as on a simulated rig.
    pub covering_memory: Option<Arc<dyn CoveringMemory>>,
}

impl fmt::Debug for Devices {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Devices").finish_non_exhaustive()
    }
}

/// The run engine of one rig. Clones are handles to the same engine, which ends when the last is dropped.
#[derive(Clone)]
pub struct Engine {
    shared: Arc<Shared>,
    acquisition: Arc<AcquisitionTask>,
}

impl fmt::Debug for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Engine").field("rig", &self.shared.rig.name).finish_non_exhaustive()
    }
}

/// Who stops a run, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StopOrder {
    /// Who stops: `cli`, `signal`, or a bus client's name.
    pub by: String,
    /// The reason, for the run's events; may be empty.
    pub reason: String,
    /// True if the data so far must not be used: the run then ends as aborted instead of stopped.
    pub abort: bool,
}

/// Health of the acquisition, for the heartbeat.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pulse {
    /// Frames received since the start.
    pub frames: u64,
    /// Frames known to be lost since the start.
    pub frames_lost: u64,
    /// True while the sensor answers.
    pub sensor_connected: bool,
    /// Arrival time of the last frame.
    pub last_frame: MonoTime,
    /// Time of the supervisor's last check of the clock.
    pub supervised: MonoTime,
    /// Last sign of life of the stage's driver, as of the supervisor's last check of the clock.
    pub stage_driven: MonoTime,
    /// Least and greatest of (arrival of a frame - its device time) over the recent frames, in seconds. They estimate
    /// the device clock's offset and its uncertainty; `None` without a device clock.
    pub clock_offset_s: Option<[f64; 2]>,
}

/// Another run is in progress.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("run {run_id} is in progress: wait for it, or stop it with `tactus stop`")]
#[expect(missing_docs, reason = "the message says what each field is")]
pub struct Busy {
    pub run_id: String,
}

/// The run was stopped before it began.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct Stopped {
    /// Who stopped it and why.
    pub reason: String,
}

/// Why the stage could not be reset.
#[derive(Debug, thiserror::Error)]
pub enum ResetError {
    /// A run is in progress.
    #[error(transparent)]
    Busy(#[from] Busy),
    /// Somebody stopped it.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The stage reported an error.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// A device did not answer, or somebody stopped the wait for it.
    #[error("{0}")]
    NotReady(String),
}

/// Why an engine could not be started.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum EngineError {
    /// The rig file describes recorded data and has no service part.
    #[error(
        "rig {rig:?} has no envelope, motion, policy, sensor and stage: it describes data, not a service"
    )]
    NoService { rig: String },
    /// The covering that was last in place is not known.
    #[error(
        "the covering that was last confirmed cannot be read: {why}; see which one is in place, then remove the file"
    )]
    Covering { why: String },
}

/// What the run, the acquisition task and the handles share. The live state is the acquisition task's alone.
pub(crate) struct Shared {
    pub(crate) rig: Rig,
    pub(crate) service: Service,
    pub(crate) clock: Clock,
    pub(crate) stage: Arc<dyn Stage>,
    pub(crate) change_covering: Option<ChangeCovering>,
    pub(crate) covering_memory: Option<Arc<dyn CoveringMemory>>,
    pub(crate) publish: Arc<dyn Publish>,
    pub(crate) control: watch::Sender<Control>,
    pub(crate) state: watch::Sender<pb::RunState>,
    pub(crate) pulse: watch::Sender<Pulse>,
    /// The sensor's driver broke off by a defect.
    pub(crate) sensor_broke_off: watch::Sender<bool>,
    /// The supervisor's fault, kept up to date by the acquisition task.
    pub(crate) fault: watch::Sender<Option<Fault>>,
    /// What the supervisor did last, kept by the acquisition task.
    pub(crate) safety: watch::Sender<Option<pb::SafetyEvent>>,
    /// The covering in place, kept up to date by the run.
    pub(crate) covering: watch::Sender<Covering>,
    pub(crate) acquisition: Mailbox,
    permits: Revocation,
    way_up: Mutex<WayUp>,
    /// A thinner covering was asked for, and nobody has confirmed yet that it is in place.
    pub(crate) is_covering_asked: AtomicBool,
}

/// Requests to the run in progress.
#[derive(Debug, Clone, Default)]
pub(crate) struct Control {
    /// Somebody holds the [`Claim`].
    pub(crate) claimed: bool,
    /// Who paused it.
    pub(crate) paused: Option<String>,
    /// Who resumed it last.
    pub(crate) resumed_by: String,
    /// The covering that the run waits for, in mm: to be confirmed by its value.
    pub(crate) wanted_covering_mm: Option<f64>,
    pub(crate) ending: Option<Ending>,
}

/// Why a run was not resumed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ResumeError {
    /// No run is paused.
    #[error("no run is paused")]
    NotPaused,
    /// The run waits for another covering, and its thickness was not confirmed.
    #[error(
        "the run waits for the {wanted_mm} mm covering: once it is in place, `tactus resume --covering-mm {wanted_mm}`"
    )]
    CoveringNotConfirmed {
        /// Thickness of the covering that the script asked for.
        wanted_mm: f64,
    },
}

/// Ends the acquisition task with the engine.
struct AcquisitionTask(JoinHandle<()>);

impl Drop for AcquisitionTask {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// Message of a run that was told to pause and still does a step.
const PAUSES_SOON: &str = "pauses before its next step";

/// Coverings that differ by less, in mm, are the same.
pub(crate) const SAME_COVERING_MM: f64 = 1e-6;

impl Engine {
    /// Starts acquiring.
    ///
    /// # Errors
    /// [`EngineError`] if the rig has no service part, or the covering in place is not known.
    pub fn start(
        rig: Rig,
        devices: Devices,
        clock: Clock,
        publish: Arc<dyn Publish>,
    ) -> Result<Self, EngineError> {
        let Some(service) = rig.service.clone() else {
            return Err(EngineError::NoService { rig: rig.name });
        };
        let idle = pb::RunState {
            phase: pb::RunPhase::Idle.into(),
            simulated: rig.simulated,
            remaining_s: -1.0,
            fault: Fault::Started.to_string(),
            ..Default::default()
        };
        let covering = covering_in_place(&rig, devices.covering_memory.as_deref())?;
        let mut supervisor = Supervisor::new(&rig, &service);
        supervisor.set_covering(covering);
        let (mailbox, questions) = mailbox();
        let shared = Arc::new(Shared {
            rig,
            service,
            clock,
            stage: devices.stage,
            change_covering: devices.change_covering,
            covering_memory: devices.covering_memory,
            publish,
            control: watch::Sender::default(),
            state: watch::Sender::new(idle),
            pulse: watch::Sender::default(),
            sensor_broke_off: watch::Sender::default(),
            fault: watch::Sender::new(supervisor.fault()),
            safety: watch::Sender::default(),
            covering: watch::Sender::new(covering),
            acquisition: mailbox,
            permits: supervisor.revocation(),
            way_up: Mutex::default(),
            is_covering_asked: AtomicBool::new(false),
        });
        let acquiring =
            acquire(Arc::clone(&shared), supervisor, questions, devices.sensor, devices.stage_reports);
        // What it logs names the rig, if the caller's span does.
        let task = tokio::spawn(acquiring.in_current_span());
        Ok(Self { shared, acquisition: Arc::new(AcquisitionTask(task)) })
    }

    /// The rig, with the covering that is in place now.
    pub fn rig(&self) -> Rig {
        self.shared.rig_in_place()
    }

    /// The clock of all times of this engine.
    pub fn clock(&self) -> Clock {
        self.shared.clock
    }

    /// Takes the exclusive right to run. A caller takes it before it prepares the run, so that a stop during the
    /// preparation ends the run too.
    ///
    /// # Errors
    /// [`Busy`] if somebody else holds it.
    pub fn claim(&self) -> Result<Claim, Busy> {
        let taken = self.shared.control.send_if_modified(|control| {
            let free = !control.claimed;
            if free {
                *control = Control { claimed: true, ..Control::default() };
            }
            free
        });
        if taken {
            Ok(Claim {
                shared: Arc::clone(&self.shared),
                acquisition: Arc::clone(&self.acquisition),
                before: Mutex::default(),
            })
        } else {
            Err(Busy { run_id: self.run_id() })
        }
    }

    /// Executes an experiment. Returns after the tip is retracted, however the run ended.
    ///
    /// # Errors
    /// [`Busy`] if another run is in progress.
    pub async fn run(&self, order: RunOrder, record: Box<dyn Record>) -> Result<RunOutcome, Busy> {
        Ok(self.claim()?.run(order, record).await)
    }

    /// Stops motion at once and ends the run in progress or in preparation, if there is one. Does not wait.
    ///
    /// While the tip rises straight up, a stop within a second after another of this rise has no effect: stops without end would
    /// hold it in contact.
    ///
    /// Returns true if there was one.
    pub fn stop(&self, order: StopOrder) -> bool {
        // Set the reason before the stop: a move checks the reason after it has joined the stop order.
        let claimed = self.shared.control.borrow().claimed;
        if claimed {
            self.shared.end(Ending::Stop(order));
        }
        if self.shared.way_up().takes_stop(self.shared.clock.now().mono) {
            self.shared.stop_motion();
        }
        claimed
    }

    /// Returns once nobody holds the right to run.
    pub async fn released(&self) {
        let mut control = self.shared.control.subscribe();
        // Waiting cannot fail because the sender lives as long as this engine.
        let _released = control.wait_for(|control| !control.claimed).await;
    }

    fn run_id(&self) -> String {
        self.shared.state.borrow().run_id.clone()
    }

    /// Clears the stage's alarm, if there is one, homes the stage, raises the tip, and checks that frames arrive. It is
    /// required after the service starts, after a broken safety rule, an alarm, a reset of the controller, an unfinished
    /// homing or a failed retract. [`Engine::stop`] interrupts it.
    ///
    /// # Errors
    /// [`ResetError`] if a run is in progress or the reset failed.
    pub async fn reset(&self) -> Result<(), ResetError> {
        let claim = self.claim()?;
        let shared = Arc::clone(&self.shared);
        // A task of its own: it ends properly even if the caller gives up, and its panic is not the caller's.
        let resetting = async move {
            let steps = Arc::clone(&shared);
            let task = tokio::spawn(async move { steps.reset().await }.in_current_span());
            let done = match task.await {
                Ok(done) => done,
                Err(panic) => {
                    shared.stop_motion();
                    let why = format!("the reset: {panic}");
                    shared.acquisition.tell(move |live| live.supervisor.latch(Fault::Defect(why))).await?;
                    Err(ResetError::NotReady("a defect of Tactus; see the log".into()))
                }
            };
            shared
                .acquisition
                .ask(|live| {
                    live.supervisor.end();
                    live.refresh_state();
                })
                .await?;
            drop(claim);
            done
        };
        let resetting = tokio::spawn(resetting.in_current_span());
        resetting.await.unwrap_or_else(|panic| Err(ResetError::NotReady(panic.to_string())))
    }

    /// The fault that requires an [`Engine::reset`]; `None` if motion is allowed. No run starts while there is one.
    pub fn fault(&self) -> Option<Fault> {
        self.shared.fault.borrow().clone()
    }

    /// What the safety supervisor did last; `None` if it did nothing since the start.
    pub fn safety(&self) -> Option<pb::SafetyEvent> {
        self.shared.safety.borrow().clone()
    }

    /// Pauses the run in progress before its next step. Every press ends at the safe height, so a paused run does not
    /// press.
    ///
    /// Returns false if there is no run to pause.
    pub fn pause(&self, by: &str) -> bool {
        let claimed = self.shared.control.borrow().claimed;
        self.shared.control.send_if_modified(|control| {
            let goes_on = control.ending.as_ref().is_none_or(Ending::is_silence);
            let holds = control.claimed && goes_on && control.paused.is_none();
            if holds {
                control.paused = Some(by.to_owned());
            }
            holds
        });
        self.tell_while_running(PAUSES_SOON);
        claimed
    }

    /// Resumes a paused run. If the run waits for another covering, `covering_mm` confirms that the covering of this
    /// thickness is in place.
    ///
    /// # Errors
    /// [`ResumeError`] if no run was paused, or if the covering is not confirmed by its value.
    pub fn resume(&self, by: &str, covering_mm: Option<f64>) -> Result<(), ResumeError> {
        let mut refused = None;
        self.shared.control.send_if_modified(|control| {
            refused = if control.paused.is_none() {
                Some(ResumeError::NotPaused)
            } else {
                let unconfirmed = |wanted_mm: &f64| {
                    !covering_mm.is_some_and(|mm| (mm - wanted_mm).abs() < SAME_COVERING_MM)
                };
                let wanted_mm = control.wanted_covering_mm.filter(unconfirmed);
                wanted_mm.map(|wanted_mm| ResumeError::CoveringNotConfirmed { wanted_mm })
            };
            if refused.is_none() {
                control.paused = None;
                control.wanted_covering_mm = None;
                by.clone_into(&mut control.resumed_by);
            }
            refused.is_none()
        });
        if let Some(refused) = refused {
            return Err(refused);
        }
        self.tell_while_running("");
        Ok(())
    }

    /// Says in the state of a run that has not paused yet whether it will.
    fn tell_while_running(&self, message: &str) {
        let told = self.shared.state.send_if_modified(|state| {
            let is_news = state.phase() == pb::RunPhase::Running && state.message != message;
            if is_news {
                message.clone_into(&mut state.message);
            }
            is_news
        });
        if told {
            self.shared.publish.state(&self.shared.state.borrow());
        }
    }

    /// Records in the run in progress that somebody took the lease over.
    pub fn record_takeover(&self, taken: pb::LeaseTaken) {
        let mailbox = self.shared.acquisition.clone();
        tokio::spawn(async move {
            let event = pb::run_event::Event::LeaseTaken(taken);
            if let Err(gone) = mailbox.tell(move |live| live.emit(event)).await {
                tracing::error!("a takeover is not recorded: {gone}");
            }
        });
    }

    /// State of the run, updated at each event and every half second.
    pub fn state(&self) -> watch::Receiver<pb::RunState> {
        self.shared.state.subscribe()
    }

    /// Present state of the run, with the fault that requires a reset.
    pub fn run_state(&self) -> pb::RunState {
        let state = self.shared.state.borrow().clone();
        pb::RunState { fault: self.shared.fault_text(), ..state }
    }

    /// Returns once the sensor's driver has broken off by a defect: only another engine reads the sensor again.
    pub async fn broken_off(&self) {
        let mut broke_off = self.shared.sensor_broke_off.subscribe();
        // Waiting cannot fail because the sender lives as long as this engine.
        let _broken_off = broke_off.wait_for(|broke_off| *broke_off).await;
    }

    /// Health of the acquisition, updated with each frame: who waits for a change is woken as often.
    pub fn pulse(&self) -> watch::Receiver<Pulse> {
        self.shared.pulse.subscribe()
    }

    /// A copy of the stage's latest report.
    pub fn stage_state(&self) -> pb::StageState {
        *self.shared.stage.state().borrow()
    }

    /// True while the acquisition task lives.
    pub fn is_acquiring(&self) -> bool {
        !self.acquisition.0.is_finished()
    }
}

/// The covering of the rig file or the one that was last confirmed, whichever is thinner: the limit of depth follows it.
fn covering_in_place(rig: &Rig, memory: Option<&dyn CoveringMemory>) -> Result<Covering, EngineError> {
    let in_file_mm = rig.covering.thickness_mm;
    let kept_mm = memory.map_or(Ok(None), CoveringMemory::recall);
    let kept_mm = kept_mm.map_err(|error| EngineError::Covering { why: error.to_string() })?;
    if let Some(kept_mm) = kept_mm.filter(|kept_mm| (kept_mm - in_file_mm).abs() > SAME_COVERING_MM) {
        tracing::warn!(
            kept_mm,
            in_file_mm,
            "the last run and the rig file name different coverings: the thinner counts"
        );
    }
    Ok(Covering { thickness_mm: kept_mm.map_or(in_file_mm, |kept_mm| kept_mm.min(in_file_mm)) })
}

impl From<Broken> for ResetError {
    fn from(broken: Broken) -> Self {
        match broken {
            Broken::Ended(_) => Self::Stopped(Stopped { reason: broken.to_string() }),
            Broken::Stage(error) => Self::Stage(error),
            Broken::Outside(_)
            | Broken::Denied(_)
            | Broken::Gone(_)
            | Broken::FramesLost(_)
            | Broken::Disturbed
            | Broken::SensorSilent(_)
            | Broken::StageSilent(..)
            | Broken::RepeatedInVain { .. }
            | Broken::Script(_)
            | Broken::Refused(_) => Self::NotReady(broken.to_string()),
        }
    }
}

impl From<Gone> for ResetError {
    fn from(gone: Gone) -> Self {
        Self::NotReady(gone.to_string())
    }
}

impl Shared {
    /// The rig, with the covering that is in place now.
    pub(crate) fn rig_in_place(&self) -> Rig {
        Rig { covering: *self.covering.borrow(), ..self.rig.clone() }
    }

    /// Status of the stage, as last reported.
    pub(crate) fn status(&self) -> pb::StageStatus {
        self.stage.state().borrow().status()
    }

    /// What is known of the tip's way up.
    pub(crate) fn way_up(&self) -> MutexGuard<'_, WayUp> {
        // What a panic left is as good as what was there before.
        self.way_up.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Stops motion now and voids all permits. Never waits.
    pub(crate) fn stop_motion(&self) {
        self.permits.revoke();
        self.stage.stop();
    }

    /// The fault in words; empty if there is none.
    pub(crate) fn fault_text(&self) -> String {
        self.fault.borrow().as_ref().map_or_else(String::new, ToString::to_string)
    }

    /// Asks the run to end. The first reason counts, except that any other reason replaces a silence of the sensor,
    /// after which the run might have continued. True if this one counts.
    pub(crate) fn end(&self, ending: Ending) -> bool {
        let mut counts = false;
        self.control.send_modify(|control| {
            // A run goes on after a silence, and a pause holds.
            if !ending.is_silence() {
                control.paused = None;
                control.wanted_covering_mm = None;
            }
            counts = control.ending.as_ref().is_none_or(Ending::is_silence);
            if counts {
                control.ending = Some(ending);
            }
        });
        counts
    }

    /// Sample period of the sensor.
    pub(crate) fn sample_period(&self) -> Duration {
        Duration::from_secs_f64(1.0 / self.rig.array.rate_hz())
    }
}

/// The exclusive right to run. Dropping it gives it back.
#[must_use = "the right is given back when this is dropped"]
pub struct Claim {
    shared: Arc<Shared>,
    #[expect(dead_code, reason = "a run keeps the acquisition alive, whoever drops the engine")]
    acquisition: Arc<AcquisitionTask>,
    /// What was told before the preparation of a run was, which holds again if there is no run.
    before: Mutex<Option<pb::RunState>>,
}

impl fmt::Debug for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Claim").finish_non_exhaustive()
    }
}

impl Claim {
    /// Executes an experiment, and returns when it is over and the tip retracted, however it ended. The run goes on if
    /// the caller does not wait for it.
    pub async fn run(self, order: RunOrder, record: Box<dyn Record>) -> RunOutcome {
        let (run_id, experiment) = (order.run_id.clone(), order.script.name().to_owned());
        let span = info_span!("run", run_id, experiment, exit_status = field::Empty, presses = field::Empty);
        // A task of its own, watched by another: neither a panic of the run nor an impatient caller leaves the tip.
        let run = async move {
            let shared = Arc::clone(&self.shared);
            self.before().take();
            let run = tokio::spawn(Run::execute(Arc::clone(&shared), order.clone(), record).instrument(span));
            let outcome = match run.await {
                Ok(outcome) => outcome,
                Err(panic) => rescue(&shared, order, &panic).await,
            };
            self.finish(&outcome);
            outcome
        };
        let run = tokio::spawn(run.in_current_span());
        run.await.unwrap_or_else(|panic| RunOutcome::defect(run_id, experiment, panic.to_string()))
    }

    /// Gives the right back and tells that the run is finished. Whoever is told can begin the next run, and nothing of that
    /// one is told before: its first state waits for this one.
    fn finish(self, outcome: &RunOutcome) {
        let shared = Arc::clone(&self.shared);
        shared.state.send_modify(|state| {
            drop(self);
            state.phase = pb::RunPhase::Finished.into();
            state.exit_status = outcome.exit_status.into();
            state.message.clone_from(&outcome.message);
            state.frames = outcome.frames;
            state.frames_lost = outcome.frames_lost;
            state.elapsed_s = outcome.duration_s;
            state.remaining_s = 0.0;
            shared.publish.state(state);
        });
    }

    /// Checks whether the run was stopped already.
    ///
    /// # Errors
    /// [`Stopped`], with the reason.
    pub fn check(&self) -> Result<(), Stopped> {
        self.shared.check_ended().map_err(|ended| Stopped { reason: ended.to_string() })
    }

    /// Tells how far the preparation of a run is: `presses` of its dry run, and the wall-clock time so far and left.
    pub fn prepares(&self, run_id: &str, experiment: &str, presses: u32, [elapsed_s, remaining_s]: [f64; 2]) {
        let shared = &self.shared;
        let preparing = pb::RunState {
            run_id: run_id.to_owned(),
            experiment: experiment.to_owned(),
            phase: pb::RunPhase::Preparing.into(),
            presses,
            elapsed_s,
            remaining_s,
            message: "dry run".into(),
            simulated: shared.rig.simulated,
            t_mono_ns: shared.clock.now().mono.ns(),
            fault: shared.fault_text(),
            ..pb::RunState::default()
        };
        let told = shared.state.send_replace(preparing);
        self.before().get_or_insert(told);
        shared.publish.state(&shared.state.borrow());
    }

    fn before(&self) -> MutexGuard<'_, Option<pb::RunState>> {
        self.before.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        let before = self.before().take();
        if let Some(before) = before {
            self.shared.state.send_replace(before);
            self.shared.publish.state(&self.shared.state.borrow());
        }
        self.shared.control.send_modify(|control| control.claimed = false);
    }
}
