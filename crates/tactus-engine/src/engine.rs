//! The engine owns the devices for the life of the service and executes at most one run at a time.

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

/// Puts a covering of a thickness in mm in place. Only a simulated rig has such a function.
pub type ChangeCovering = Arc<dyn Fn(f64) + Send + Sync>;

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

/// Why nothing may move before an [`Engine::reset`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// The engine is new, and nobody has allowed motion yet.
    #[error("nothing has been reset since the service started")]
    Started,
    /// A reset is under way, or the last one failed.
    #[error("the last reset was not finished")]
    Unfinished,
    /// The stage's controller is in alarm.
    #[error("the stage is in alarm")]
    Alarm,
    /// The stage does not know its position, as after a reset of its controller.
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
}

/// State that the run, the acquisition task and the handles share.
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
    /// A fault that only a reset clears.
    latched: watch::Sender<Option<Fault>>,
    live: Mutex<Live>,
}

/// Requests to the run in progress.
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
        if taken { Ok(Claim(Arc::clone(&self.shared))) } else { Err(Busy { run_id: self.run_id() }) }
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
    /// Returns true if there was one.
    pub fn stop(&self, order: StopOrder) -> bool {
        // Set the reason before the stop: a move checks the reason after it has joined the stop order.
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
        // Waiting cannot fail because the sender lives as long as this engine.
        let _released = control.wait_for(|control| !control.claimed).await;
    }

    fn run_id(&self) -> String {
        self.shared.state.borrow().run_id.clone()
    }

    /// Clears the stage's alarm, if there is one, homes the stage, raises the tip, and checks that frames arrive. It is
    /// required after the service starts, and after an alarm, a reset of the controller or an unfinished homing.
    /// [`Engine::stop`] interrupts it.
    ///
    /// # Errors
    /// [`ResetError`] if a run is in progress or the reset failed.
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
        // Make the order before the check, so that a stop between the two counts as later than the order.
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

    /// The fault that requires an [`Engine::reset`]; `None` if motion is allowed. No run starts while there is one.
    pub fn fault(&self) -> Option<Fault> {
        self.shared.fault()
    }

    /// Pauses the run in progress before its next step. Every press ends at the safe height, so a paused run does not
    /// press.
    ///
    /// Returns false if there is no run to pause.
    pub fn pause(&self) -> bool {
        let claimed = self.shared.control.borrow().claimed;
        self.shared.control.send_if_modified(|control| {
            let holds = control.claimed && control.ending.is_none() && !control.paused;
            control.paused |= holds;
            holds
        });
        claimed
    }

    /// Resumes a paused run. Returns false if no run was paused.
    pub fn resume(&self) -> bool {
        self.shared.control.send_if_modified(|control| std::mem::take(&mut control.paused))
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

    /// Health of the acquisition, updated with each frame.
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

impl Shared {
    /// Sets or clears the fault that forbids motion.
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

    /// State that the acquisition task and the run share. The lock is never held across an await.
    pub(crate) fn live(&self) -> MutexGuard<'_, Live> {
        // A panic elsewhere must not stop the supervisor.
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks the run to end. The first reason counts, except that any other reason replaces a silence of the sensor,
    /// after which the run might have continued.
    pub(crate) fn end(&self, ending: Ending) {
        self.control.send_modify(|control| {
            control.paused = false;
            if control.ending.as_ref().is_none_or(Ending::is_silence) {
                control.ending = Some(ending);
            }
        });
    }

    /// Sample period of the sensor.
    pub(crate) fn sample_period(&self) -> Duration {
        Duration::from_secs_f64(1.0 / self.rig.array.rate_hz())
    }
}

/// The exclusive right to run. Dropping it gives it back.
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

    /// Checks whether the run was stopped already.
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
