//! The service: acquires frames from start to end, answers commands, runs experiments.
//!
//! | task | waits for |
//! |---|---|
//! | acquisition (in the engine) | frames, reports of the stage, the supervisor's clock |
//! | stops (a thread) | `cmd/stop`, `tactus/stop` and datagrams; nothing else, so that no other command can delay it |
//! | commands | `cmd/run`, `cmd/pause`, `cmd/resume`, `cmd/reset`, `cmd/status`, `cmd/experiments`, `cmd/plan` |
//! | run | the order of one run, until its recording is closed |
//! | health | once a second |
//! | closing of crashed runs (once, at the start) | the disk |
//! | watchdog | an eighth of systemd's limit |
//! | inhibitor | the beginning and the end of a run |
//! | main | a signal that ends the service |

mod catalogue;
mod commands;
mod description;
mod health;
mod lease;
mod publish;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use clap::{CommandFactory, Parser};
use tactus_bus::{Bus, BusConfig, BusError, Calls, TlsConfig};
use tactus_device::Clock;
use tactus_engine::{Engine, EngineError, StopOrder};
use tactus_log::LogFormat;
use tactus_runner::config::{ConfigError, RigFiles, ServiceConfig, TlsSection};
use tactus_runner::covering_file::CoveringFile;
use tactus_runner::crashed::{self, Crashed};
use tactus_runner::devices;
use tactus_runner::embedded::Truth;
use tactus_runner::signals::EndingSignals;
use tactus_schema::key::Keys;
use tokio::runtime::Handle;
use tokio::task::JoinHandle;
use tokio::time::timeout;
use tracing::{error, info};

use crate::inhibitor;
use crate::notify::{self, Systemd};
use commands::CommandDesk;
use publish::BusPublisher;

/// Time for a run to retract and close its recording at shutdown.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(30);

/// The lab service of Tactus.
#[derive(Debug, Parser)]
#[command(name = "tactusd", version, about)]
struct Options {
    /// The configuration file.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Log format; overrides the configuration.
    #[arg(long, value_enum)]
    log: Option<LogFormat>,
    /// Folder of recordings; overrides the configuration.
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
}

/// Why the service ended.
#[derive(Debug, thiserror::Error)]
enum ServiceError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Engine(#[from] EngineError),
    #[error(transparent)]
    Bus(#[from] BusError),
    #[error("the system provides no {what}: {source}")]
    System { what: &'static str, source: std::io::Error },
    #[error("the run did not close within {SHUTDOWN_TIMEOUT:?}: its recording may lack its end")]
    Hung,
}

/// The options of `tactusd`.
pub fn command() -> clap::Command {
    Options::command()
}

/// Runs `tactusd` with the process's arguments.
pub fn main() -> ExitCode {
    let options = Options::parse();
    let config = match ServiceConfig::load(&options.config) {
        Ok(config) => config,
        Err(error) => {
            let _log = tactus_log::start(options.log.unwrap_or_default(), "info");
            error!("{error}");
            return ExitCode::from(2);
        }
    };
    let _log = tactus_log::start(options.log.unwrap_or(config.log.format), &config.log.filter);
    // Clients are told where a recording is, and have other working directories.
    let recordings = match std::path::absolute(options.recordings.as_ref().unwrap_or(&config.recordings)) {
        Ok(recordings) => recordings,
        Err(error) => {
            error!("the folder of recordings: {error}");
            return ExitCode::FAILURE;
        }
    };
    match start(ServiceConfig { recordings, ..config }) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            error!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn start(config: ServiceConfig) -> Result<(), ServiceError> {
    let system = |what| move |source| ServiceError::System { what, source };
    let runtime =
        tokio::runtime::Builder::new_multi_thread().enable_all().build().map_err(system("runtime"))?;
    let served = runtime.block_on(serve(config));
    // A computation that still runs, such as a dry run, does not delay the end of the process.
    runtime.shutdown_background();
    served
}

async fn serve(config: ServiceConfig) -> Result<(), ServiceError> {
    let system = |what| move |source| ServiceError::System { what, source };
    // Before a device is opened, so that no signal leaves the tip where it is.
    let mut signals = EndingSignals::listen().map_err(system("signals"))?;

    let systemd = Systemd::start().map_err(system("thread"))?;
    let rig = &config.rig.rig;
    let keys = Keys::new(rig.name.clone());
    info!(rig = rig.name, simulated = rig.simulated, recordings = %config.recordings.display(), "tactusd starts");
    let endpoints = BusConfig {
        listen: config.bus.listen.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
        connect: config.bus.connect.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
        guests: config.bus.guests.clone(),
        tls: config.bus.tls.clone().map(certificates),
    };
    let recordings = config.recordings.clone();
    let closing = tokio::task::spawn_blocking(move || crashed::close_all(&recordings));
    let (bus, calls) = Bus::open(&endpoints, keys).await?;
    let served = attend(config, &bus, calls, &systemd, &mut signals, closing).await;
    // Whatever has happened: no thread of ours may be in the bus's library when the process ends.
    bus.close().await?;
    info!("closed");
    served
}

/// Acquires frames and answers commands until a signal ends the service.
async fn attend(
    config: ServiceConfig,
    bus: &Bus,
    Calls { stops, commands }: Calls,
    systemd: &Systemd,
    signals: &mut EndingSignals,
    closing: JoinHandle<Vec<Crashed>>,
) -> Result<(), ServiceError> {
    let system = |what| move |source| ServiceError::System { what, source };
    let clock = Clock::real();
    let RigFiles { rig, codec, .. } = config.rig.clone();
    let Some(rig_service) = rig.service.clone() else {
        return Err(EngineError::NoService { rig: rig.name }.into());
    };
    let truth = || Truth::of_rig(&rig, clock.now().wall.ns().unsigned_abs());
    let mut opened = devices::open(&rig, &rig_service, codec, truth, clock);
    if opened.devices.change_covering.is_none() {
        // A person changes the covering, and may do so while the service is down.
        let file = CoveringFile::of(&rig.name, &config.recordings);
        opened.devices.covering_memory = Some(Arc::new(file));
    }
    let engine = Engine::start(rig, opened.devices, clock, Arc::new(BusPublisher(bus.publisher())))?;

    let desk = Arc::new(CommandDesk::new(engine.clone(), config, bus.publisher()));
    // A thread of its own: no task that waits or computes can keep it from running. It ends with the bus.
    let (stop_desk, runtime) = (Arc::clone(&desk), Handle::current());
    thread::Builder::new()
        .name("stops".into())
        .spawn(move || {
            let _entered = runtime.enter();
            stop_desk.answer_stops(stops);
        })
        .map_err(system("thread"))?;
    let tasks = [
        tokio::spawn(Arc::clone(&desk).answer_commands(commands)),
        tokio::spawn(health::publish(engine.clone(), bus.publisher(), {
            let desk = Arc::clone(&desk);
            move || desk.holder()
        })),
        tokio::spawn(notify::feed_watchdog(engine.clone(), desk.recorder(), systemd.clone())),
        tokio::spawn(inhibitor::keep_awake(engine.clone())),
    ];

    let mut alive = None;
    let signalled = tokio::select! {
        biased;
        ending = signals.next() => ending.name,
        never = async {
            frames_flow(&engine).await;
            if closing.await.is_err() {
                error!("the recordings were not checked for crashed runs: this is a defect of Tactus");
            }
            alive = Some(bus.declare_alive().await);
            systemd.ready(&engine.rig().name);
            info!("ready: frames flow");
            std::future::pending::<&str>().await
        } => never,
    };
    info!("{signalled}: closing down");
    systemd.stopping();
    let closed = end_run(&engine, signalled).await;
    drop(alive);
    for task in tasks {
        task.abort();
    }
    closed
}

fn certificates(tls: TlsSection) -> TlsConfig {
    let TlsSection { authority, certificate, key, commanders, readers, check_certificate, check_key } = tls;
    TlsConfig { authority, certificate, key, commanders, readers, check: check_certificate.zip(check_key) }
}

async fn frames_flow(engine: &Engine) {
    let mut pulse = engine.pulse();
    if pulse.wait_for(|pulse| pulse.sensor_connected && pulse.frames > 1).await.is_err() {
        std::future::pending::<()>().await;
    }
}

/// Ends the run in progress: stop, retract, close the recording.
async fn end_run(engine: &Engine, signalled: &str) -> Result<(), ServiceError> {
    engine.stop(StopOrder {
        by: "signal".into(),
        reason: format!("{signalled}: the service closes down"),
        abort: false,
    });
    timeout(SHUTDOWN_TIMEOUT, engine.released()).await.map_err(|_| ServiceError::Hung)
}
