//! One run: from the first check to the closed recording.

mod steps;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tactus_device::StageError;
use tactus_model::Covering;
use tactus_plan::{Arguments, Evaluate, Limits, RigView, Script};
use tactus_schema::table::Phase;
use tactus_schema::{MonoTime, Rig, pb};
use tokio::time::timeout;
use tracing::{error, info};

use crate::engine::{Shared, StopOrder};
use crate::envelope::{Bounds, Outside};
use crate::outlet::Record;
use crate::script::{self, Request};
use crate::supervisor::Violation;
use pb::run_event::Event;

/// Averaging time of the run's reference zero.
const REFERENCE: Duration = Duration::from_millis(300);

/// An experiment to be run.
#[derive(Debug, Clone)]
pub struct RunOrder {
    /// Unique name of the run.
    pub run_id: String,
    /// Parsed experiment script.
    pub script: Script,
    /// The parameters that differ from their defaults.
    pub arguments: Arguments,
    /// Seed of the script's random order.
    pub seed: u64,
    /// Who asked for it.
    pub who: String,
    /// Bounds of the script's steps, time and memory.
    pub limits: Limits,
    /// Where the script is evaluated.
    pub evaluator: Arc<dyn Evaluate>,
    /// Prediction of the dry run, if there was one.
    pub planned: Option<Planned>,
    /// Names and versions of the software and the devices.
    pub versions: BTreeMap<String, String>,
    /// Where the recording goes, for the run's state.
    pub recording: String,
    /// True if the run also replaces an [`crate::Engine::reset`], as on an engine that was made for this run alone: it
    /// homes a stage that does not know its position. It does not clear an alarm.
    pub resets: bool,
}

/// Prediction of a dry run on the simulated twin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planned {
    /// Number of presses.
    pub presses: u32,
    /// Number of dwells.
    pub dwells: u32,
    /// Time from the first step until the tip is retracted.
    pub duration_s: f64,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOutcome {
    /// The run's name.
    pub run_id: String,
    /// The experiment's name.
    pub experiment: String,
    /// Exit status.
    pub exit_status: pb::ExitStatus,
    /// The reason, for a person.
    pub message: String,
    /// Frames received and recorded.
    pub frames: u64,
    /// Frames known to be lost.
    pub frames_lost: u64,
    /// Completed presses.
    pub presses: u32,
    /// Completed dwells of completed presses.
    pub dwells: u32,
    /// Time from the first step until the tip was retracted.
    pub duration_s: f64,
    /// Least and greatest x, y and z that were commanded, robot frame.
    pub travel_mm: [[f64; 2]; 3],
}

/// Why a run was asked to end before its script did.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Ending {
    Stop(StopOrder),
    Safety(Violation),
    FramesLost(u64),
    RecordFailed(String),
}

/// Why a step was not done.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Broken {
    #[error("{}", describe(.0))]
    Ended(Ending),
    #[error(transparent)]
    Outside(#[from] Outside),
    #[error(transparent)]
    Stage(#[from] StageError),
    #[error("{0} frames were lost during a dwell")]
    FramesLost(u64),
    #[error("no frame from the sensor for {0:.1} s: is it plugged in and switched on?")]
    SensorSilent(f64),
    #[error("no answer from the stage for {0:.1} s: is it plugged in and switched on?")]
    StageSilent(f64),
    #[error("{0}")]
    Script(String),
    #[error("{0}")]
    Refused(String),
}

impl Ending {
    /// True for a silence of the sensor: the run may continue once frames arrive again.
    pub(crate) fn is_silence(&self) -> bool {
        matches!(self, Self::Safety(Violation::Silence { .. }))
    }
}

fn describe(ending: &Ending) -> String {
    match ending {
        Ending::Stop(order) => {
            let how = if order.abort { "aborted" } else { "stopped" };
            let why = if order.reason.is_empty() { String::new() } else { format!(": {}", order.reason) };
            format!("{how} by {}{why}", order.by)
        }
        Ending::Safety(violation) => format!("safety stop: {violation}"),
        Ending::FramesLost(lost) => {
            format!("{lost} frames were lost, and the rig's policy.on_gap is \"fail\"")
        }
        Ending::RecordFailed(failure) => failure.clone(),
    }
}

/// A run in progress.
pub(crate) struct Run<'a> {
    shared: &'a Shared,
    order: RunOrder,
    bounds: Bounds,
    covering: Covering,
    started: MonoTime,
    steps: u64,
    next_press: i32,
    presses: u32,
    dwells: u32,
    zero_counts: Vec<f64>,
    phase: Option<(Phase, i32)>,
    travel_mm: [[f64; 2]; 3],
}

impl<'a> Run<'a> {
    pub(crate) fn new(shared: &'a Shared, order: RunOrder) -> Self {
        let rig = &shared.rig;
        let covering = shared.live().covering;
        Self {
            shared,
            bounds: Bounds::new(rig, &shared.service.envelope, &shared.service.motion, covering),
            covering,
            started: shared.clock.now().mono,
            steps: 0,
            next_press: 0,
            presses: 0,
            dwells: 0,
            zero_counts: rig.baseline_counts.clone(),
            phase: None,
            travel_mm: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
            order,
        }
    }

    /// Runs the experiment. Whatever happens, the tip is retracted and the recording closed.
    pub(crate) async fn execute(mut self, record: Box<dyn Record>) -> RunOutcome {
        info!(run = self.order.run_id, experiment = self.order.script.name(), "run starts");
        self.shared.open_recording(record, self.order.run_id.clone());
        self.set_state(pb::RunPhase::Preparing, "preparing");
        self.shared.emit(Event::Started(self.describe_start()));
        let mut result = self.admit().await;
        if matches!(result, Err(Broken::Refused(_))) {
            // The tip is not moved, not even up.
            let z_mm = self.shared.position_mm()[2];
            return self.conclude(&result, Ok(z_mm));
        }
        if result.is_ok() {
            result = self.prepare().await;
        }
        if result.is_ok() {
            self.set_state(pb::RunPhase::Running, "");
            result = self.run_script().await;
        }
        self.set_state(pb::RunPhase::Stopping, "retracting");
        if let Err(Broken::Ended(Ending::Stop(order))) = &result {
            self.shared.emit(Event::StopRequested(pb::StopRequested {
                by: order.by.clone(),
                reason: order.reason.clone(),
                abort: order.abort,
            }));
        }
        let retracted = self.clean_up().await;
        self.conclude(&result, retracted)
    }

    /// Checks that the stage answers and that no reset is required.
    async fn admit(&self) -> Result<(), Broken> {
        self.shared.wait_for_stage().await?;
        match self.shared.fault().filter(|_| !self.order.resets) {
            Some(fault) => self.refused("reset", fault.to_string()),
            None => Ok(()),
        }
    }

    /// Waits for the sensor, homes the stage if necessary, raises the tip and takes the reference zero.
    async fn prepare(&mut self) -> Result<(), Broken> {
        self.set_phase(Phase::Idle, -1);
        let now = self.shared.clock.now().mono;
        {
            let mut live = self.shared.live();
            live.supervisor.begin(self.bounds.depth_max_mm());
            live.supervisor.rearm(now);
        }
        self.shared.wait_for_sensor().await?;
        if self.order.resets {
            self.home().await?;
        }
        self.shared.retract().await?;
        let reference = self.whole_average(REFERENCE).await?;
        self.zero_counts.clone_from(&reference.mean_counts);
        self.shared.live().supervisor.set_reference(reference.mean_counts);
        Ok(())
    }

    /// Homes the stage if it does not know where it is.
    async fn home(&self) -> Result<(), Broken> {
        if self.shared.stage.state().borrow().status() == pb::StageStatus::Unhomed {
            info!("homing the stage");
            // As in a reset: make the order before the check.
            let homing = self.shared.stage.home();
            self.shared.check_ended()?;
            let homed = homing.await;
            // If it was stopped, the reason of the stop is the error.
            self.shared.check_ended()?;
            homed?;
        }
        self.shared.latch(None);
        Ok(())
    }

    async fn run_script(&mut self) -> Result<(), Broken> {
        let view = RigView::of(&Rig { covering: self.covering, ..self.shared.rig.clone() });
        let mut requests =
            script::start(&self.order, view, self.shared.control.subscribe(), self.shared.clock.is_virtual())
                .map_err(|error| Broken::Script(format!("no thread for the script: {error}")))?;
        let mut broken = None;
        while let Some(request) = requests.next().await {
            match request {
                Request::Step(call, answer) => {
                    let result = self.perform(&call).await;
                    let reply = result.map_err(|reason| {
                        let refusal = refusal(&reason);
                        broken.get_or_insert(reason);
                        refusal
                    });
                    // The script waits for the answer. If its thread died, `next` returns `None`.
                    let _told = answer.send(reply);
                }
                Request::Ended(Ok(_)) => return broken.map_or(Ok(()), Err),
                // The script's error repeats the cause, with the line.
                Request::Ended(Err(error)) => {
                    self.shared.check_ended()?;
                    return Err(match broken {
                        Some(Broken::Outside(_)) => return self.refused("envelope", error.to_string()),
                        _ => Broken::Script(error.to_string()),
                    });
                }
            }
        }
        Err(Broken::Script("the script's thread died; this is a defect of Tactus".into()))
    }

    fn refused(&self, rule: &str, message: String) -> Result<(), Broken> {
        self.shared.emit_safety(pb::SafetyVerdict::Refused, rule, &message);
        Err(Broken::Refused(message))
    }

    /// Retracts the tip and records the outcome.
    async fn clean_up(&mut self) -> Result<f64, StageError> {
        self.set_phase(Phase::Retract, self.phase.map_or(-1, |(_, press)| press));
        let retracted = self.shared.retract().await;
        self.set_phase(Phase::Idle, -1);
        let cleanup = match &retracted {
            Ok(z_mm) => pb::Cleanup { retracted: true, z_mm: *z_mm, detail: String::new() },
            Err(error) => {
                error!(%error, "the tip could not be retracted");
                pb::Cleanup {
                    retracted: false,
                    z_mm: self.shared.position_mm()[2],
                    detail: error.to_string(),
                }
            }
        };
        self.shared.emit(Event::Cleanup(cleanup));
        retracted
    }

    /// Closes the recording and returns the outcome.
    fn conclude(self, result: &Result<(), Broken>, retracted: Result<f64, StageError>) -> RunOutcome {
        let tally = self.shared.live().tally;
        let (mut exit_status, mut message) = verdict(result, tally.frames_lost);
        if let Err(error) = retracted {
            exit_status = pb::ExitStatus::Failed;
            message = format!("{message}; THE TIP IS NOT RETRACTED: {error}");
        }
        let duration_s = self.shared.clock.now().mono.since(self.started).as_secs_f64();
        self.shared.emit(Event::Finished(pb::RunFinished {
            exit_status: exit_status.into(),
            message: message.clone(),
            frames: tally.frames,
            frames_lost: tally.frames_lost,
            presses: self.presses,
            dwells: self.dwells,
            duration_s,
        }));
        if let Err(failure) = self.shared.close_recording() {
            exit_status = pb::ExitStatus::Failed;
            message = failure.to_string();
        }
        info!(run = self.order.run_id, exit_status = exit_status.as_str_name(), message, "run ends");
        self.shared.state.send_modify(|state| {
            state.phase = pb::RunPhase::Finished.into();
            state.exit_status = exit_status.into();
            state.message.clone_from(&message);
            state.frames = tally.frames;
            state.frames_lost = tally.frames_lost;
            state.elapsed_s = duration_s;
            state.remaining_s = 0.0;
        });
        self.shared.refresh_state();
        RunOutcome {
            run_id: self.order.run_id,
            experiment: self.order.script.name().to_owned(),
            exit_status,
            message,
            frames: tally.frames,
            frames_lost: tally.frames_lost,
            presses: self.presses,
            dwells: self.dwells,
            duration_s,
            travel_mm: self.travel_mm,
        }
    }

    fn describe_start(&self) -> pb::RunStarted {
        let rig = &self.shared.rig;
        let planned = self.order.planned.unwrap_or(Planned { presses: 0, dwells: 0, duration_s: 0.0 });
        pb::RunStarted {
            experiment: self.order.script.name().to_owned(),
            rig: rig.name.clone(),
            who: self.order.who.clone(),
            simulated: rig.simulated,
            seed: self.order.seed,
            script_sha256: self.order.script.sha256().to_owned(),
            parameters_json: self.order.arguments.to_json(),
            covering_mm: self.covering.thickness_mm,
            indenter: rig.indenter.clone(),
            presses_planned: planned.presses,
            dwells_planned: planned.dwells,
            duration_planned_s: planned.duration_s,
            versions: self.order.versions.clone(),
        }
    }

    fn set_phase(&mut self, phase: Phase, press: i32) {
        if self.phase.replace((phase, press)) != Some((phase, press)) {
            self.shared
                .emit(Event::PhaseChanged(pb::PhaseChanged { phase: pb::Phase::from(phase).into(), press }));
        }
    }

    fn set_state(&self, phase: pb::RunPhase, message: &str) {
        let now = self.shared.clock.now().mono;
        let tally = self.shared.live().tally;
        let planned = self.order.planned;
        let elapsed_s = now.since(self.started).as_secs_f64();
        self.shared.state.send_replace(pb::RunState {
            run_id: self.order.run_id.clone(),
            experiment: self.order.script.name().to_owned(),
            phase: phase.into(),
            presses: self.presses,
            presses_planned: planned.map_or(0, |planned| planned.presses),
            dwells: self.dwells,
            dwells_planned: planned.map_or(0, |planned| planned.dwells),
            frames: tally.frames,
            frames_lost: tally.frames_lost,
            elapsed_s,
            remaining_s: planned.map_or(-1.0, |planned| (planned.duration_s - elapsed_s).max(0.0)),
            message: message.to_owned(),
            exit_status: pb::ExitStatus::Unspecified.into(),
            recording: self.order.recording.clone(),
            simulated: self.shared.rig.simulated,
            t_mono_ns: now.ns(),
            fault: self.shared.fault_text(),
        });
        self.shared.publish.state(&self.shared.state.borrow());
    }
}

impl Shared {
    /// Waits until frames arrive, as long as the rig's policy allows.
    pub(crate) async fn wait_for_sensor(&self) -> Result<(), Broken> {
        let patience = Duration::from_millis(self.service.policy.reconnect_ms.into());
        let since = self.clock.now().mono;
        let mut pulse = self.pulse.subscribe();
        let flowing = pulse.wait_for(|pulse| pulse.sensor_connected && pulse.last_frame > since);
        match self.unless_ended(timeout(patience, flowing)).await? {
            Ok(_) => Ok(()),
            Err(_) => Err(Broken::SensorSilent(patience.as_secs_f64())),
        }
    }

    /// Waits until the stage answers, as long as the rig's policy allows. Other problems show at the first move.
    pub(crate) async fn wait_for_stage(&self) -> Result<(), Broken> {
        let patience = Duration::from_millis(self.service.policy.reconnect_ms.into());
        let mut state = self.stage.state();
        let answering = state.wait_for(|report| {
            !matches!(report.status(), pb::StageStatus::Unspecified | pb::StageStatus::Disconnected)
        });
        match self.unless_ended(timeout(patience, answering)).await? {
            Ok(_) => Ok(()),
            Err(_) => Err(Broken::StageSilent(patience.as_secs_f64())),
        }
    }

    /// An error if the run was asked to end.
    pub(crate) fn check_ended(&self) -> Result<(), Broken> {
        self.control.borrow().ending.clone().map_or(Ok(()), |ending| Err(Broken::Ended(ending)))
    }

    /// The result of `future`, unless the run is asked to end first.
    pub(crate) async fn unless_ended<T>(&self, future: impl Future<Output = T>) -> Result<T, Broken> {
        let mut control = self.control.subscribe();
        tokio::select! {
            biased;
            // Waiting cannot fail because the sender lives in `self`; otherwise the future decides.
            Ok(control) = control.wait_for(|control| control.ending.is_some()) => {
                let ending = control.ending.clone();
                drop(control);
                match ending {
                    Some(ending) => Err(Broken::Ended(ending)),
                    None => unreachable!("waited for an ending"),
                }
            }
            value = future => Ok(value),
        }
    }
}

fn refusal(broken: &Broken) -> tactus_plan::Refusal {
    use tactus_plan::Refusal;
    match broken {
        Broken::Ended(_) => Refusal::Stopped(broken.to_string()),
        Broken::Outside(outside) => Refusal::Outside(outside.to_string()),
        Broken::Stage(_)
        | Broken::FramesLost(_)
        | Broken::SensorSilent(_)
        | Broken::StageSilent(_)
        | Broken::Script(_)
        | Broken::Refused(_) => Refusal::Failed(broken.to_string()),
    }
}

fn verdict(result: &Result<(), Broken>, frames_lost: u64) -> (pb::ExitStatus, String) {
    use pb::ExitStatus;
    let Err(broken) = result else {
        return match frames_lost {
            0 => (ExitStatus::Done, String::new()),
            lost => (
                ExitStatus::Degraded,
                format!("{lost} frames were lost; the dwells they touched were repeated"),
            ),
        };
    };
    let status = match broken {
        Broken::Ended(Ending::Stop(order)) if order.abort => ExitStatus::Aborted,
        Broken::Ended(Ending::Stop(_)) => ExitStatus::Stopped,
        Broken::Ended(ending) if ending.is_silence() => ExitStatus::Failed,
        Broken::Ended(Ending::Safety(_)) | Broken::Outside(_) | Broken::Refused(_) => ExitStatus::Refused,
        Broken::Ended(Ending::FramesLost(_) | Ending::RecordFailed(_))
        | Broken::Stage(_)
        | Broken::FramesLost(_)
        | Broken::SensorSilent(_)
        | Broken::StageSilent(_)
        | Broken::Script(_) => ExitStatus::Failed,
    };
    (status, broken.to_string())
}
