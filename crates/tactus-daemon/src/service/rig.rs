//! One rig of the service: its engine and its commands, from its file until the service ends. Whatever fails in it ends here: the
//! rig is then off, says why, and is started again.

use std::fs;
use std::panic::AssertUnwindSafe;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use futures_util::FutureExt;
use tactus_bus::{Bus, BusError, CommandCall, Node};
use tactus_device::{Clock, SensorCodec};
use tactus_engine::{Engine, EngineError, StopOrder};
use tactus_plan::Evaluate;
use tactus_runner::config::{RigFiles, Rigs, ServiceConfig};
use tactus_runner::covering_file::CoveringFile;
use tactus_runner::crashed;
use tactus_runner::devices::OpenedRig;
use tactus_runner::embedded::Truth;
use tactus_schema::key::{Command, Keys};
use tactus_schema::{Rig as RigDescription, pb, rig};
use tokio::sync::{mpsc, watch};
use tokio::time::{interval, sleep, timeout};
use tracing::{error, info, warn};

use super::commands::{CommandDesk, Places};
use super::health;
use super::publish::BusPublisher;
use super::standing::{Standing, Standings};
use super::stops::Desks;
use crate::inhibitor::Runs;

/// Time until a rig that failed is started again.
const AGAIN: Duration = Duration::from_secs(5);

/// Time for a run to retract and close its recording.
const CLOSING_TIMEOUT: Duration = Duration::from_secs(30);

/// What the rigs of a service share. No frame touches it.
pub(super) struct Service {
    pub(super) config: ServiceConfig,
    pub(super) desks: Desks,
    pub(super) standings: Standings,
    pub(super) runs: Runs,
    pub(super) open: OpenDevices,
    /// Of all rigs, so that the times of one that starts again go on.
    pub(super) clock: Clock,
    /// Evaluates scripts.
    pub(super) evaluator: Arc<dyn Evaluate>,
    /// Why the service ends, once it does.
    pub(super) ending: watch::Receiver<Option<&'static str>>,
}

/// Starts a rig's devices, as [`tactus_runner::devices::open`] does.
pub(super) type OpenDevices = Box<
    dyn Fn(&RigDescription, &rig::Service, SensorCodec, &dyn Fn() -> Truth, Clock) -> OpenedRig + Send + Sync,
>;

/// One rig, as the configuration has it.
pub(super) struct Rig {
    pub(super) name: Arc<str>,
    /// What is known of it.
    pub(super) state: State,
    pub(super) bus: Bus,
    pub(super) commands: mpsc::Receiver<Box<CommandCall>>,
}

/// Whether a rig can be started.
pub(super) enum State {
    /// Its files could be read.
    Known(Arc<RigFiles>),
    /// They could not, or contradict those of others.
    Refused { files: Vec<PathBuf>, problem: String },
}

/// Why a rig does not work.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error(transparent)]
    Bus(#[from] BusError),
    #[error("a task of it broke off: this is a defect of Tactus, see the log")]
    Panic,
    #[error("the run did not close within {CLOSING_TIMEOUT:?}: its recording may lack its end")]
    Hung,
}

/// Puts every rig of the configuration on the bus. Nothing has been opened yet.
///
/// # Errors
/// If the bus refuses one.
pub(super) async fn all(node: &Arc<Node>, config: &mut ServiceConfig) -> Result<Vec<Rig>, BusError> {
    // Each keeps its own files: with many rigs a second copy would count.
    let known = std::mem::take(&mut config.rigs.served);
    let known = known.into_iter().map(|files| (Arc::from(&*files.rig.name), State::Known(Arc::new(files))));
    let mut rigs: Vec<(Arc<str>, State)> = known.collect();
    for refused in &config.rigs.refused {
        let same = rigs.iter_mut().find(|(name, _)| **name == *refused.name);
        match same.map(|(_, state)| state) {
            Some(State::Refused { files, problem }) => {
                files.push(refused.path.clone());
                // Rigs of one name have one problem, which names all files.
                if *problem != refused.problem {
                    *problem = format!("{problem}\n{}", refused.problem);
                }
            }
            Some(State::Known(_)) => {}
            None => {
                let (files, problem) = (vec![refused.path.clone()], refused.problem.clone());
                rigs.push((Arc::from(&*refused.name), State::Refused { files, problem }));
            }
        }
    }
    let mut all = Vec::new();
    for (name, state) in rigs {
        let (bus, mut commands) = node.serve(Keys::new(&*name)).await?;
        if all.is_empty() {
            // The rules of all rigs have one form.
            node.check_denials(&bus, &mut commands).await?;
        }
        all.push(Rig { name, state, bus, commands });
    }
    Ok(all)
}

impl Rig {
    /// Keeps the rig up until the service ends.
    ///
    /// # Errors
    /// If the run in progress could not be closed, or the bus did not close. The failure of the only rig of a service, too: who
    /// started the service starts it again.
    pub(super) async fn keep(mut self, service: Arc<Service>) -> Result<(), RigError> {
        let mut ended = Ok(());
        while service.ending.borrow().is_none() {
            let problem = match &self.state {
                State::Known(files) => {
                    let files = Arc::clone(files);
                    // A panic is this rig's alone.
                    let attended = AssertUnwindSafe(self.attend(&files, &service)).catch_unwind().await;
                    service.desks.remove(&self.name);
                    match attended.unwrap_or(Err(Failure::Panic)) {
                        Ok(()) => break,
                        Err(failure) => {
                            if !service.config.rigs.are_several || service.ending.borrow().is_some() {
                                ended = Err(RigError::Failed { rig: self.name.to_string(), failure });
                                break;
                            }
                            failure.to_string()
                        }
                    }
                }
                State::Refused { problem, .. } => problem.clone(),
            };
            self.stay_off(&problem, &service).await;
        }
        self.bus.close().await?;
        ended
    }

    /// Acquires frames and answers commands until the service ends.
    async fn attend(&mut self, files: &Arc<RigFiles>, service: &Service) -> Result<(), Failure> {
        service.standings.set(&self.name, Standing::Starts);
        let recordings = service.config.recordings_of(&self.name);
        let closing = {
            let recordings = recordings.clone();
            tokio::task::spawn_blocking(move || {
                // Clients look into it, and nobody waits for the first run to learn that there can be none.
                if let Err(error) = fs::create_dir_all(&recordings) {
                    error!("no run can be recorded: cannot make {}: {error}", recordings.display());
                }
                crashed::close_all(&recordings)
            })
        };
        let RigFiles { rig, codec, .. } = RigFiles::clone(files);
        let clock = service.clock;
        let Some(rig_service) = rig.service.clone() else {
            return Err(EngineError::NoService { rig: rig.name }.into());
        };
        let truth = || Truth::of_rig(&rig, clock.now().wall.ns().unsigned_abs());
        let mut opened = (service.open)(&rig, &rig_service, codec, &truth, clock);
        if opened.devices.change_covering.is_none() {
            // A person changes the covering, and may do so while the service is down.
            opened.devices.covering_memory = Some(Arc::new(CoveringFile::of_rig(&rig, &recordings)));
        }
        let publisher = self.bus.publisher();
        let engine = Engine::start(rig, opened.devices, clock, Arc::new(BusPublisher(publisher.clone())))?;
        let places =
            Places { files: Arc::clone(files), recordings, experiments: service.config.experiments.clone() };
        let evaluator = Arc::clone(&service.evaluator);
        let desk = Arc::new(CommandDesk::new(engine.clone(), places, publisher.clone(), evaluator));
        service.desks.add(&self.name, &desk);

        let (bus, commands, name) = (&self.bus, &mut self.commands, &self.name);
        let mut alive = None;
        let ready = async {
            frames_flow(&engine).await;
            if closing.await.is_err() {
                error!("the recordings were not checked for crashed runs: this is a defect of Tactus");
            }
            alive = Some(bus.declare_alive().await?);
            service.standings.set(name, Standing::Flows);
            info!("ready: frames flow");
            broken_off(&engine).await;
            Err::<(), _>(Failure::Panic)
        };
        let mut ending = service.ending.clone();
        let serving = async {
            tokio::select! {
                biased;
                why = ending.wait_for(Option::is_some) => {
                    let why = why.ok().and_then(|why| *why);
                    Ok(why.unwrap_or("the service has ended"))
                }
                broken = ready => Err(broken.err().unwrap_or(Failure::Panic)),
                () = desk.answer_commands(commands) => Ok("the bus has closed"),
                () = health::publish(&desk, &publisher) => Err(Failure::Panic),
                () = service.runs.count(&engine) => Err(Failure::Panic),
            }
        };
        // After a panic of one of these the run is ended all the same.
        let served = AssertUnwindSafe(serving).catch_unwind().await.unwrap_or(Err(Failure::Panic));
        let (by, reason) = match &served {
            Ok(why) => ("signal", format!("{why}: the service closes down")),
            Err(failure) => ("service", failure.to_string()),
        };
        let closed = end_run(&engine, by, reason).await;
        drop(alive);
        closed.and(served.map(drop))
    }

    /// Says why the rig does not work until it is time to start it again, or the service ends.
    async fn stay_off(&mut self, problem: &str, service: &Service) {
        error!("{problem}");
        service.standings.set(&self.name, Standing::Off(problem.to_owned()));
        let (clock, publisher) = (service.clock, self.bus.publisher());
        let (name, commands) = (&self.name, &mut self.commands);
        let mut tick = interval(health::PERIOD);
        let mut ending = service.ending.clone();
        let again = wait_again(&mut self.state, name, service);
        tokio::pin!(again);
        loop {
            tokio::select! {
                biased;
                _ = ending.wait_for(Option::is_some) => return,
                () = &mut again => return,
                Some(call) = commands.recv() => {
                    let reply = refusal(name, problem, call.command, clock);
                    call.reply.reply(reply);
                }
                _ = tick.tick() => publisher.publish(&health::of_missing(problem, clock.now())),
            }
        }
    }
}

/// Why a rig did not end well.
#[derive(Debug, thiserror::Error)]
pub(super) enum RigError {
    #[error(transparent)]
    Bus(#[from] BusError),
    #[error("rig {rig:?}: {failure}")]
    Failed { rig: String, failure: Failure },
}

/// Waits until the rig can be tried again: a while or, if its files are wrong, until one of them has changed and is right.
async fn wait_again(state: &mut State, name: &str, service: &Service) {
    let State::Refused { files, .. } = state else {
        return sleep(AGAIN).await;
    };
    let changed = |files: &[PathBuf]| -> Vec<Option<SystemTime>> {
        files.iter().map(|file| fs::metadata(file).and_then(|found| found.modified()).ok()).collect()
    };
    let mut seen = changed(files);
    loop {
        sleep(AGAIN).await;
        let now = changed(files);
        if std::mem::replace(&mut seen, now.clone()) == now {
            continue;
        }
        let all = service.config.rigs.files.clone();
        let Ok(Ok(rigs)) = tokio::task::spawn_blocking(|| Rigs::load(all)).await else { continue };
        if let Some(files) = rigs.served.into_iter().find(|files| files.rig.name == name) {
            *state = State::Known(Arc::new(files));
            return;
        }
        for refused in rigs.refused.iter().filter(|refused| refused.name == name) {
            warn!("{}", refused.problem);
        }
    }
}

/// The answer of a rig that is off.
fn refusal(rig: &str, problem: &str, command: Command, clock: Clock) -> pb::CommandReply {
    let is_question = command == Command::Status;
    pb::CommandReply {
        ok: is_question,
        error: if is_question { String::new() } else { format!("rig {rig:?} is off: {problem}") },
        exit_code: u32::from(!is_question),
        rig: rig.to_owned(),
        version: env!("CARGO_PKG_VERSION").into(),
        health: Some(health::of_missing(problem, clock.now())),
        ..Default::default()
    }
}

async fn frames_flow(engine: &Engine) {
    let mut pulse = engine.pulse();
    if pulse.wait_for(|pulse| pulse.sensor_connected && pulse.frames > 1).await.is_err() {
        std::future::pending::<()>().await;
    }
}

/// Returns once nobody reads the sensor any more, and no run needs the stage.
async fn broken_off(engine: &Engine) {
    engine.broken_off().await;
    engine.released().await;
}

/// Ends the run in progress: stop, retract, close the recording.
async fn end_run(engine: &Engine, by: &str, reason: String) -> Result<(), Failure> {
    engine.stop(StopOrder { by: by.into(), reason, abort: false });
    timeout(CLOSING_TIMEOUT, engine.released()).await.map_err(|_| Failure::Hung)
}

#[cfg(test)]
#[path = "rig_tests.rs"]
mod tests;
