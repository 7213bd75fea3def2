//! One run: from the first check to the closed recording.

mod broken;
mod replay;
mod steps;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tactus_device::StageError;
use tactus_plan::{Arguments, Evaluate, RigView, Script, ScriptLimits};
use tactus_safety::Fault;
use tactus_schema::table::Phase;
use tactus_schema::{MonoTime, pb};
use tokio::task::{JoinError, spawn_blocking};
use tokio::time::timeout;
use tracing::{Span, error, info};

use crate::acquisition::{Acquisition, Ended, Tally};
use crate::engine::Shared;
use crate::envelope::Bounds;
use crate::outlet::{Record, RecordFailure};
use crate::script::{self, Request};
pub(crate) use broken::{Broken, Ending};
use broken::{done, refusal, verdict};
use pb::run_event::Event;
use replay::Replay;
pub use replay::{DoneStep, EarlierRun};
use steps::as_f32;

/// Averaging time of the run's reference zero.
const REFERENCE: Duration = Duration::from_millis(300);

/// Longest time to close a recording.
const CLOSE_PATIENCE: Duration = Duration::from_secs(30);

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
    pub limits: ScriptLimits,
    /// Where the script is evaluated.
    pub evaluator: Arc<dyn Evaluate>,
    /// The earlier run that this one goes on with. Script, arguments and seed are those of it.
    pub earlier: Option<Arc<EarlierRun>>,
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

/// A run in progress.
pub(crate) struct Run {
    shared: Arc<Shared>,
    order: RunOrder,
    bounds: Bounds,
    started: MonoTime,
    /// The run has begun to move.
    is_prepared: bool,
    /// Until the first step that no earlier run has done.
    replay: Option<Replay>,
    taken_over: Option<pb::TakenOver>,
    steps: u64,
    next_press: i32,
    presses: u32,
    dwells: u32,
    zero_counts: Vec<f64>,
    phase: Option<(Phase, i32)>,
    travel_mm: [[f64; 2]; 3],
}

impl Run {
    /// Runs the experiment. Whatever happens, the tip is retracted and the recording closed.
    pub(crate) async fn execute(shared: Arc<Shared>, order: RunOrder, record: Box<dyn Record>) -> RunOutcome {
        info!(run = order.run_id, experiment = order.script.name(), "run starts");
        let mut run = Self::new(shared, order);
        let run_id = run.order.run_id.clone();
        let opened = run.shared.acquisition.tell(move |live| live.open_recording(record, run_id)).await;
        let result = match opened {
            Ok(()) => run.run_to_end().await.map_err(|broken| run.reason_of(broken)),
            Err(gone) => Err(gone.into()),
        };
        if !run.is_prepared {
            // Nothing has moved, and the tip is not moved now, not even up.
            let z_mm = run.shared.position_mm()[2];
            return run.conclude(&result, Ok(z_mm)).await;
        }
        let retracted = run.end(&result).await;
        run.conclude(&result, retracted).await
    }

    fn new(shared: Arc<Shared>, order: RunOrder) -> Self {
        let rig = &shared.rig;
        let covering = *shared.covering.borrow();
        Self {
            bounds: Bounds::new(rig, &shared.service.envelope, &shared.service.motion, covering),
            started: shared.clock.now().mono,
            is_prepared: false,
            replay: order.earlier.clone().map(Replay::of),
            taken_over: order.earlier.as_ref().map(|earlier| earlier.taken_over()),
            steps: 0,
            next_press: order.earlier.as_ref().map_or(0, |earlier| earlier.next_press),
            presses: 0,
            dwells: 0,
            zero_counts: rig.baseline_counts.clone(),
            phase: None,
            travel_mm: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
            order,
            shared,
        }
    }

    /// From the first check to the end of the script.
    async fn run_to_end(&mut self) -> Result<(), Broken> {
        self.set_state(pb::RunPhase::Preparing, "preparing").await;
        self.emit(Event::Started(self.describe_start())).await;
        self.admit().await?;
        self.prepare().await?;
        self.set_state(pb::RunPhase::Running, "").await;
        self.run_script().await
    }

    /// The order to end, if what broke the run is only that the stage was stopped by it.
    fn reason_of(&self, broken: Broken) -> Broken {
        match (&broken, self.shared.check_ended()) {
            (Broken::Stage(StageError::Stopped { .. }) | Broken::Disturbed, Err(ended)) => ended,
            _ => broken,
        }
    }

    /// Retracts the tip after the script, or after what broke it.
    async fn end(&mut self, result: &Result<(), Broken>) -> Result<f64, Broken> {
        self.set_state(pb::RunPhase::Stopping, "retracting").await;
        if let Err(Broken::Ended(Ending::Stop(order))) = result {
            self.emit(Event::StopRequested(pb::StopRequested {
                by: order.by.clone(),
                reason: order.reason.clone(),
                abort: order.abort,
            }))
            .await;
        }
        self.clean_up().await
    }

    /// Checks that the stage answers and that no reset is required.
    async fn admit(&self) -> Result<(), Broken> {
        self.shared.wait_for_stage().await?;
        let fault = self.shared.acquisition.ask(|live| live.supervisor.fault()).await?;
        match fault.filter(|_| !self.order.resets) {
            Some(fault) => self.refused("reset", fault.to_string()).await,
            None => Ok(()),
        }
    }

    /// Waits for the sensor, homes the stage if necessary, raises the tip and takes the reference zero.
    async fn prepare(&mut self) -> Result<(), Broken> {
        self.set_phase(Phase::Idle, -1).await;
        self.shared.acquisition.ask(|live| live.supervisor.begin_run()).await?;
        self.shared.wait_for_sensor().await?;
        self.is_prepared = true;
        if self.order.resets {
            self.shared.reset_for_run().await?;
        }
        self.shared.retract().await?;
        self.take_reference().await
    }

    /// Takes the run's first zero, with the tip up.
    async fn take_reference(&mut self) -> Result<(), Broken> {
        let reference = self.whole_average(REFERENCE).await?;
        self.emit(Event::ReferenceDone(pb::ReferenceDone {
            frames: reference.frames,
            mean_counts: as_f32(&reference.mean_counts),
            from_mono_ns: reference.span[0].ns(),
            to_mono_ns: reference.span[1].ns(),
        }))
        .await;
        self.zero_counts.clone_from(&reference.mean_counts);
        let set =
            self.shared.acquisition.ask(move |live| live.supervisor.set_reference(&reference.mean_counts));
        match set.await? {
            Ok(()) => Ok(()),
            Err(violation) => self.refused(violation.rule(), violation.to_string()).await,
        }
    }

    async fn run_script(&mut self) -> Result<(), Broken> {
        let mut requests = script::start(
            &self.order,
            self.view(),
            self.shared.control.subscribe(),
            self.shared.clock.is_virtual(),
        )
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
                Request::Ended(Ok(_)) => {
                    if let Some(broken) = broken {
                        return Err(broken);
                    }
                    return match self.replay.as_ref().map_or(Ok(()), Replay::check_over) {
                        Ok(()) => Ok(()),
                        Err(difference) => self.refused("continue", difference).await,
                    };
                }
                // The script's error repeats the cause, with the line.
                Request::Ended(Err(error)) => {
                    self.shared.check_ended()?;
                    return match broken {
                        Some(Broken::Outside(_)) => self.refused("envelope", error.to_string()).await,
                        Some(Broken::Refused(_)) => Err(Broken::Refused(error.to_string())),
                        _ => Err(Broken::Script(error.to_string())),
                    };
                }
            }
        }
        Err(Broken::Script("the script's thread died; this is a defect of Tactus".into()))
    }

    /// The rig as the script sees it. A run that goes on with an earlier one begins with the rig of that one.
    fn view(&self) -> RigView {
        let mut rig = self.shared.rig_in_place();
        if let Some(earlier) = &self.order.earlier {
            rig.covering.thickness_mm = earlier.covering_mm;
        }
        RigView::of(&rig)
    }

    async fn refused(&self, rule: &'static str, message: String) -> Result<(), Broken> {
        let detail = message.clone();
        let told = self.shared.acquisition.tell(move |live| {
            live.emit_safety(pb::SafetyVerdict::Refused, rule, &detail);
        });
        told.await?;
        Err(Broken::Refused(message))
    }

    /// Retracts the tip and records the outcome. A tip that cannot be retracted is a fault until the next reset.
    async fn clean_up(&mut self) -> Result<f64, Broken> {
        self.set_phase(Phase::Retract, self.phase.map_or(-1, |(_, press)| press)).await;
        let retracted = self.shared.retract_or_latch().await;
        self.set_phase(Phase::Idle, -1).await;
        let cleanup = match &retracted {
            Ok(z_mm) => pb::Cleanup { retracted: true, z_mm: *z_mm, detail: String::new() },
            Err(broken) => {
                let z_mm = self.shared.position_mm()[2];
                pb::Cleanup { retracted: false, z_mm, detail: broken.to_string() }
            }
        };
        self.emit(Event::Cleanup(cleanup)).await;
        retracted
    }

    /// Closes the recording and returns the outcome.
    async fn conclude(self, result: &Result<(), Broken>, retracted: Result<f64, Broken>) -> RunOutcome {
        let duration_s = self.shared.clock.now().mono.since(self.started).as_secs_f64();
        let uncounted = pb::RunFinished {
            presses: self.presses,
            dwells: self.dwells,
            duration_s,
            ..pb::RunFinished::default()
        };
        let broken = result.as_ref().err().map(verdict);
        let finished = {
            let uncounted = uncounted.clone();
            move |tally: Tally| {
                let (mut exit_status, mut message) = broken.unwrap_or_else(|| done(tally.frames_lost));
                if let Err(error) = retracted {
                    exit_status = pb::ExitStatus::Failed;
                    let before = if message.is_empty() { message } else { format!("{message}; ") };
                    message = format!("{before}THE TIP IS NOT RETRACTED: {error}");
                }
                let Tally { frames, frames_lost } = tally;
                pb::RunFinished { exit_status: exit_status.into(), message, frames, frames_lost, ..uncounted }
            }
        };
        let (finished, closed) = match self.shared.acquisition.ask(|live| live.end(finished)).await {
            Ok(Ended { finished, recording }) => (finished, close(recording).await),
            Err(gone) => (uncounted, Err(RecordFailure(gone.into()))),
        };
        let (exit_status, message) = match closed {
            Ok(()) => (finished.exit_status(), finished.message),
            Err(failure) => (pb::ExitStatus::Failed, failure.to_string()),
        };
        info!(run = self.order.run_id, exit_status = exit_status.as_str_name(), message, "run ends");
        Span::current().record("exit_status", exit_status.word()).record("presses", i64::from(self.presses));
        if let Err(gone) = self.shared.acquisition.ask(Acquisition::refresh_state).await {
            error!("{gone}");
        }
        RunOutcome {
            run_id: self.order.run_id,
            experiment: self.order.script.name().to_owned(),
            exit_status,
            message,
            frames: finished.frames,
            frames_lost: finished.frames_lost,
            presses: self.presses,
            dwells: self.dwells,
            duration_s,
            travel_mm: self.travel_mm,
        }
    }

    /// Records and publishes an event.
    async fn emit(&self, event: Event) {
        if let Err(gone) = self.shared.acquisition.tell(move |live| live.emit(event)).await {
            error!("an event is lost: {gone}");
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
            covering_mm: self.shared.covering.borrow().thickness_mm,
            indenter: rig.indenter.clone(),
            presses_planned: planned.presses,
            dwells_planned: planned.dwells,
            duration_planned_s: planned.duration_s,
            versions: self.order.versions.clone(),
            taken_over: self.taken_over.clone(),
        }
    }

    async fn set_phase(&mut self, phase: Phase, press: i32) {
        if self.phase.replace((phase, press)) != Some((phase, press)) {
            self.emit(Event::PhaseChanged(pb::PhaseChanged { phase: pb::Phase::from(phase).into(), press }))
                .await;
        }
    }

    async fn set_state(&self, phase: pb::RunPhase, message: &str) {
        let now = self.shared.clock.now().mono;
        let tally = self.shared.acquisition.ask(|live| live.tally).await.unwrap_or_default();
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
            taken_over: self.taken_over.clone(),
        });
        self.shared.publish.state(&self.shared.state.borrow());
    }
}

/// What is left to do for a run whose task panicked: stop, retract, close the recording.
pub(crate) async fn rescue(shared: &Arc<Shared>, order: RunOrder, panic: &JoinError) -> RunOutcome {
    shared.stop_motion();
    error!(%panic, "the run's task failed; this is a defect of Tactus");
    let why = format!("the run: {panic}");
    shared.end(Ending::Defect(why.clone()));
    let latched = why.clone();
    let told = shared.acquisition.tell(move |live| live.supervisor.latch(Fault::Defect(latched))).await;
    let mut run = Run::new(Arc::clone(shared), order);
    let result = Err(told.map_or_else(Broken::Gone, |()| Broken::Ended(Ending::Defect(why))));
    let retracted = run.end(&result).await;
    run.conclude(&result, retracted).await
}

impl RunOutcome {
    /// The outcome of a run of which nothing is known.
    pub(crate) fn defect(run_id: String, experiment: String, message: String) -> Self {
        Self {
            run_id,
            experiment,
            exit_status: pb::ExitStatus::Failed,
            message,
            frames: 0,
            frames_lost: 0,
            presses: 0,
            dwells: 0,
            duration_s: 0.0,
            travel_mm: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
        }
    }
}

impl Shared {
    /// Latches that the tip stays where it is, and tells it loudly.
    pub(crate) async fn latch_not_retracted(&self, why: String) {
        error!("THE TIP IS NOT RETRACTED: {why}");
        let told = self.acquisition.tell(move |live| {
            live.emit_safety(
                pb::SafetyVerdict::Stopped,
                "retract",
                &format!("THE TIP IS NOT RETRACTED: {why}"),
            );
            live.supervisor.latch(Fault::NotRetracted(why));
        });
        if let Err(gone) = told.await {
            // Nobody else can tell it now.
            error!("{gone}");
            self.fault.send_replace(Some(Fault::NotRetracted(gone.to_string())));
        }
    }
}

/// Closes a recording on a thread of its own: a disk that hangs holds up nothing else.
async fn close(recording: Option<(Box<dyn Record>, Option<RecordFailure>)>) -> Result<(), RecordFailure> {
    let Some((sink, failure)) = recording else { return Ok(()) };
    let closed = match timeout(CLOSE_PATIENCE, spawn_blocking(move || sink.finish())).await {
        Ok(Ok(closed)) => closed,
        Ok(Err(panic)) => Err(RecordFailure(panic.into())),
        Err(_) => Err(RecordFailure(
            format!("it was not closed within {CLOSE_PATIENCE:?}: does the disk hang?").into(),
        )),
    };
    // The error of the end has the final counts.
    closed.and_then(|()| failure.map_or(Ok(()), Err))
}
