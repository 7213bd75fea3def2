//! The engine: the devices for the life of the service, and at most one run at a time.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tactus_device::{Clock, Sensor, Stage, StageError};
use tactus_schema::rig::Service;
use tactus_schema::{MonoTime, Rig, pb};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;

use crate::acquisition::{Live, acquire};
use crate::outlet::{Publish, Record};
use crate::run::{Broken, Ending, Run, RunOrder, RunOutcome};

/// Puts another covering in place, in mm; given by a simulated rig that can do it itself.
pub type ChangeCovering = Arc<dyn Fn(f64) + Send + Sync>;

/// A rig's devices, started.
pub struct Devices {
    /// The tactile array.
    pub sensor: Box<dyn Sensor>,
    /// The indentation stage.
    pub stage: Arc<dyn Stage>,
    /// Every report of the stage.
    pub stage_reports: mpsc::Receiver<pb::StageState>,
    /// How the covering is changed; `None` if a person does it.
    pub change_covering: Option<ChangeCovering>,
}

impl fmt::Debug for Devices {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Devices").finish_non_exhaustive()
    }
}

/// The run engine of one rig. Clones are handles to the same engine; it ends with the last.
#[derive(Clone)]
pub struct Engine {
    shared: Arc<Shared>,
    acquisition: Arc<Acquisition>,
}

impl fmt::Debug for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Engine").field("rig", &self.shared.rig.name).finish_non_exhaustive()
    }
}

/// Who stops a run, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StopOrder {
    /// Such as `cli`, `signal`, or a bus client's name.
    pub by: String,
    /// For the run's events.
    pub reason: String,
    /// The data so far are not to be used: the run ends as aborted, not as stopped.
    pub abort: bool,
}

/// A sign of life: how acquisition goes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pulse {
    /// Frames received since the start.
    pub frames: u64,
    /// Frames known to be lost since the start.
    pub frames_lost: u64,
    /// The sensor answers.
    pub sensor_connected: bool,
    /// When the last frame came.
    pub last_frame: MonoTime,
    /// When the supervisor last looked at the clock.
    pub supervised: MonoTime,
    /// Least and greatest of (arrival of a frame - its device time) seen lately, in seconds: the
    /// device clock's offset and how far it can be trusted; `None` without a device clock.
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
    /// By whom, and why.
    pub reason: String,
}

/// Why nothing moves before an [`Engine::reset`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// The engine is new: nobody has said yet that the stage may move.
    #[error("nothing has been reset since the service started")]
    Started,
    /// A reset is under way, or the last one failed.
    #[error("the last reset was not finished")]
    Unfinished,
    /// The stage's controller is in alarm.
    #[error("the stage is in alarm")]
    Alarm,
    /// The stage does not know where it is, as after a reset of its controller.
    #[error("the stage does not know where it is")]
    Unhomed,
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
    /// The stage.
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
    /// The rig is a description of data, not of a service.
    #[error(
        "rig {rig:?} has no envelope, motion, policy, sensor and stage: it describes data, not a service"
    )]
    NoService { rig: String },
}

/// What the run, the acquisition task and the handles share.
pub(crate) struct Shared {
    pub(crate) rig: Rig,
    pub(crate) service: Service,
    pub(crate) clock: Clock,
    pub(crate) stage: Arc<dyn Stage>,
    pub(crate) change_covering: Option<ChangeCovering>,
    pub(crate) publish: Arc<dyn Publish>,
    pub(crate) control: watch::Sender<Control>,
    pub(crate) state: watch::Sender<pb::RunState>,
    pub(crate) pulse: watch::Sender<Pulse>,
    /// What only a reset ends.
    latched: watch::Sender<Option<Fault>>,
    live: Mutex<Live>,
}

/// What is asked of the run in progress.
#[derive(Debug, Clone, Default)]
pub(crate) struct Control {
    /// Somebody holds the [`Claim`].
    pub(crate) claimed: bool,
    pub(crate) paused: bool,
    pub(crate) ending: Option<Ending>,
}

/// Ends the acquisition task with the engine.
struct Acquisition(JoinHandle<()>);

impl Drop for Acquisition {
    fn drop(&mut self) {
        self.0.abort();
    }
}

impl Engine {
    /// Starts acquiring.
    ///
    /// # Errors
    /// [`EngineError::NoService`] if the rig has no service part.
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
        let shared = Arc::new(Shared {
            live: Mutex::new(Live::new(&rig, &service)),
            rig,
            service,
            clock,
            stage: devices.stage,
            change_covering: devices.change_covering,
            publish,
            control: watch::Sender::default(),
            state: watch::Sender::new(idle),
            pulse: watch::Sender::default(),
            latched: watch::Sender::new(Some(Fault::Started)),
        });
        let task = tokio::spawn(acquire(Arc::clone(&shared), devices.sensor, devices.stage_reports));
        Ok(Self { shared, acquisition: Arc::new(Acquisition(task)) })
    }

    /// The rig, with the covering that is in place now.
    pub fn rig(&self) -> Rig {
        Rig { covering: self.shared.live().covering, ..self.shared.rig.clone() }
    }

    /// The clock of all times of this engine.
    pub fn clock(&self) -> Clock {
        self.shared.clock
    }

    /// Takes the right to run. Whoever means to run takes it first and prepares then: a stop from here on,
    /// be it before anything has moved, ends the run.
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
        if taken { Ok(Claim(Arc::clone(&self.shared))) } else { Err(Busy { run_id: self.run_id() }) }
    }

    /// Executes an experiment, and returns when it is over and the tip retracted, however it ended.
    ///
    /// # Errors
    /// [`Busy`] if another run is in progress.
    pub async fn run(&self, order: RunOrder, record: Box<dyn Record>) -> Result<RunOutcome, Busy> {
        Ok(self.claim()?.run(order, record).await)
    }

    /// Stops motion at once and ends the run in progress or in preparation, if there is one. Never waits.
    ///
    /// Returns true if there was one.
    pub fn stop(&self, order: StopOrder) -> bool {
        // First the reason, then the stop: whoever moves checks the one after it has joined the other's order.
        let claimed = self.shared.control.borrow().claimed;
        if claimed {
            self.shared.end(Ending::Stop(order));
        }
        self.shared.stage.stop();
        claimed
    }

    /// Returns once nobody holds the right to run.
    pub async fn released(&self) {
        let mut control = self.shared.control.subscribe();
        // The sender lives as long as this engine: waiting cannot fail.
        let _released = control.wait_for(|control| !control.claimed).await;
    }

    fn run_id(&self) -> String {
        self.shared.state.borrow().run_id.clone()
    }

    /// Clears the stage's alarm, if there is one, homes it, raises the tip, and checks that frames flow: the
    /// explicit act that a service wants after its start, and a stage after an alarm, a reset of its
    /// controller or an unfinished homing. A [`Engine::stop`] ends it.
    ///
    /// # Errors
    /// [`ResetError`] if a run is in progress, or what stands in the way.
    pub async fn reset(&self) -> Result<(), ResetError> {
        let not_ready = |why: Broken| ResetError::NotReady(why.to_string());
        let claim = self.claim()?;
        let shared = &self.shared;
        shared.latch(Some(Fault::Unfinished));
        shared.wait_for_stage().await.map_err(not_ready)?;
        let status = self.stage_state().status();
        if status == pb::StageStatus::Alarm {
            shared.stage.clear_alarm().await?;
        }
        // The order is made before the check: a stop between the two still counts as later than the order.
        let homing = shared.stage.home();
        claim.check()?;
        homing.await?;
        claim.check()?;
        shared.retract().await?;
        shared.wait_for_sensor().await.map_err(not_ready)?;
        claim.check()?;
        let status = self.stage_state().status();
        if status != pb::StageStatus::Idle {
            let what = format!("homed, the stage did not stay idle: {}", status.as_str_name());
            return Err(ResetError::NotReady(what));
        }
        shared.latch(None);
        shared.refresh_state();
        Ok(())
    }

    /// What wants a [`Engine::reset`] before anything may move; a service starts no run until it is gone.
    pub fn fault(&self) -> Option<Fault> {
        self.shared.fault()
    }

    /// Holds the run in progress before its next step. A press ends at the safe height, so that a held run
    /// presses nothing.
    ///
    /// Returns false if there is no run that could be held.
    pub fn pause(&self) -> bool {
        let claimed = self.shared.control.borrow().claimed;
        self.shared.control.send_if_modified(|control| {
            let holds = control.claimed && control.ending.is_none() && !control.paused;
            control.paused |= holds;
            holds
        });
        claimed
    }

    /// Lets a held run go on. Returns false if none was held.
    pub fn resume(&self) -> bool {
        self.shared.control.send_if_modified(|control| std::mem::take(&mut control.paused))
    }

    /// Where the run stands; changes at each event and every half second.
    pub fn state(&self) -> watch::Receiver<pb::RunState> {
        self.shared.state.subscribe()
    }

    /// Where the run stands, and what wants a reset, as of now.
    pub fn run_state(&self) -> pb::RunState {
        let state = self.shared.state.borrow().clone();
        pb::RunState { fault: self.shared.fault_text(), ..state }
    }

    /// How acquisition goes; changes with each frame.
    pub fn pulse(&self) -> watch::Receiver<Pulse> {
        self.shared.pulse.subscribe()
    }

    /// The latest report of the stage. A copy: whoever looks holds up no report.
    pub fn stage_state(&self) -> pb::StageState {
        *self.shared.stage.state().borrow()
    }

    /// True while the acquisition task lives.
    pub fn is_acquiring(&self) -> bool {
        !self.acquisition.0.is_finished()
    }
}

impl Shared {
    /// From here on the stage may move, or not.
    pub(crate) fn latch(&self, fault: Option<Fault>) {
        self.latched.send_replace(fault);
    }

    /// [`Shared::fault`] in words; empty if there is none.
    pub(crate) fn fault_text(&self) -> String {
        self.fault().map_or_else(String::new, |fault| fault.to_string())
    }

    pub(crate) fn fault(&self) -> Option<Fault> {
        let status = self.stage.state().borrow().status();
        if status == pb::StageStatus::Alarm {
            return Some(Fault::Alarm);
        }
        let latched = *self.latched.borrow();
        latched.or((status == pb::StageStatus::Unhomed).then_some(Fault::Unhomed))
    }

    /// What the acquisition task and the run share. Held only for moments, never across an await.
    pub(crate) fn live(&self) -> MutexGuard<'_, Live> {
        // A panic elsewhere must not keep the supervisor from its work.
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks the run to end. The first reason wins, but a silence, which may be forgiven, gives way to any other.
    pub(crate) fn end(&self, ending: Ending) {
        self.control.send_modify(|control| {
            control.paused = false;
            if control.ending.as_ref().is_none_or(Ending::is_silence) {
                control.ending = Some(ending);
            }
        });
    }

    /// How long one frame takes.
    pub(crate) fn sample_period(&self) -> Duration {
        Duration::from_secs_f64(1.0 / self.rig.array.rate_hz())
    }
}

/// The right to run; given back when dropped.
#[must_use = "the right is given back when this is dropped"]
pub struct Claim(Arc<Shared>);

impl fmt::Debug for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Claim").finish_non_exhaustive()
    }
}

impl Claim {
    /// Executes an experiment, and returns when it is over and the tip retracted, however it ended.
    pub async fn run(self, order: RunOrder, record: Box<dyn Record>) -> RunOutcome {
        Run::new(&self.0, order).execute(record).await
    }

    /// Tells whether the run was stopped already.
    ///
    /// # Errors
    /// [`Stopped`], with the reason.
    pub fn check(&self) -> Result<(), Stopped> {
        self.0.check_ended().map_err(|ended| Stopped { reason: ended.to_string() })
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.0.control.send_modify(|control| control.claimed = false);
    }
}
