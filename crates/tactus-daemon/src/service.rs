//! The service: acquires frames from start to end, answers commands, runs experiments; for one rig or many.
//!
//! Of each rig:
//!
//! | task | waits for |
//! |---|---|
//! | acquisition (in the engine) | frames, reports of the stage, the supervisor's clock |
//! | rig | `cmd/run`, `cmd/pause`, `cmd/resume`, `cmd/reset`, `cmd/status`, `cmd/experiments`, `cmd/plan`; a second, for the health; a failure, to start the rig again |
//! | run | the order of one run, until its recording is closed |
//! | closing of crashed runs (once, at the start) | the disk |
//!
//! Of the service:
//!
//! | task | waits for |
//! |---|---|
//! | stops (a thread) | `cmd/stop`, `tactus/stop` and datagrams; nothing else, so that no other command can delay it |
//! | watchdog | an eighth of systemd's limit |
//! | inhibitor | the beginning of the first run in progress and the end of the last |
//! | standings | a rig that starts or fails |
//! | main | a signal that ends the service |
//!
//! Rigs share the session on the bus, and no lock that a frame takes.

mod catalogue;
mod commands;
mod description;
mod health;
mod lease;
mod publish;
mod rig;
mod standing;
mod stops;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::thread;

use clap::{CommandFactory, Parser};
use tactus_bus::{BusConfig, BusError, CommandCall, Node, TlsConfig};
use tactus_device::Clock;
use tactus_log::LogFormat;
use tactus_runner::config::{ConfigError, ServiceConfig, TlsSection};
use tactus_runner::script_process::ScriptProcesses;
use tactus_runner::signals::EndingSignals;
use tactus_runner::{devices, open_files};
#[cfg(feature = "otel")]
use tactus_schema::MonoTime;
use tactus_schema::key::Keys;
use tokio::runtime::Handle;
use tokio::sync::{mpsc, watch};
use tokio::task::{JoinError, JoinSet};
use tracing::{Instrument, Span, error, error_span, info};

use crate::inhibitor::{self, Runs};
use crate::notify::{self, Systemd};
#[cfg(feature = "otel")]
use crate::telemetry::{self, Telemetry};
use rig::{Rig, RigError, Service};
use standing::Standings;
use stops::Desks;

pub(crate) use commands::CommandDesk;
pub(crate) use stops::Desks as RunningDesks;

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
    /// Collector of OpenTelemetry for spans and metrics, over HTTP. Without a value, the one of this machine at port 4318.
    #[cfg(feature = "otel")]
    #[arg(
        long,
        value_name = "URL",
        env = "OTEL_EXPORTER_OTLP_ENDPOINT",
        num_args = 0..=1,
        default_missing_value = crate::telemetry::LOOPBACK
    )]
    otlp: Option<String>,
}

/// Why the service ended.
#[derive(Debug, thiserror::Error)]
enum ServiceError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Bus(#[from] BusError),
    #[error(transparent)]
    Rig(#[from] RigError),
    #[error("the system provides no {what}: {source}")]
    System { what: &'static str, source: std::io::Error },
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
    let format = options.log.unwrap_or(config.log.format);
    #[cfg(feature = "otel")]
    let telemetry = options.otlp.as_deref().map(|url| Telemetry::start(url, &config.rigs.served)).transpose();
    #[cfg(feature = "otel")]
    let listener = telemetry.as_ref().ok().and_then(|telemetry| Some(telemetry.as_ref()?.listener()));
    #[cfg(not(feature = "otel"))]
    let listener = None;
    let _log = tactus_log::start_with(format, &config.log.filter, listener);
    #[cfg(feature = "otel")]
    let _telemetry = match telemetry {
        Ok(telemetry) => telemetry,
        Err(error) => {
            error!("{error}");
            return ExitCode::from(2);
        }
    };
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

async fn serve(mut config: ServiceConfig) -> Result<(), ServiceError> {
    let system = |what| move |source| ServiceError::System { what, source };
    // Before a device is opened, so that no signal leaves the tip where it is.
    let mut signals = EndingSignals::listen().map_err(system("signals"))?;

    open_files::allow_all();
    let systemd = Systemd::start().map_err(system("thread"))?;
    let names = names(&config);
    let simulated = config.rigs.served.iter().all(|files| files.rig.simulated);
    info!(rigs = names.join(", "), simulated, recordings = %config.recordings.display(), "tactusd starts");
    let endpoints = BusConfig {
        listen: config.bus.listen.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
        connect: config.bus.connect.iter().map(|text| text.parse()).collect::<Result<_, _>>()?,
        guests: config.bus.guests.clone(),
        frames_kept: config.bus.frames_kept,
        tls: config.bus.tls.clone().map(certificates),
    };
    let keys: Vec<_> = names.into_iter().map(Keys::new).collect();
    let (node, stops) = Node::open(&endpoints, &keys).await?;
    let rigs = rig::all(&node, &mut config).await?;
    // The last rig closes it.
    drop(node);

    let (end, ending) = watch::channel(None);
    let service = Arc::new(Service {
        config,
        desks: Desks::default(),
        standings: Standings::default(),
        runs: Runs::default(),
        open: Box::new(|rig, service, codec, truth, clock| devices::open(rig, service, codec, truth, clock)),
        clock: Clock::real(),
        evaluator: Arc::new(ScriptProcesses::of_this_program()),
        ending,
    });
    answer_stops(&service.desks, stops).map_err(system("thread"))?;
    let tasks = [
        tokio::spawn(notify::feed_watchdog(service.desks.clone(), systemd.clone())),
        tokio::spawn(inhibitor::keep_awake(service.runs.clone())),
        tokio::spawn({
            let (standings, systemd) = (service.standings.clone(), systemd.clone());
            async move { standings.tell(&systemd).await }
        }),
    ];
    let mut keeping = keep_all(rigs, &service);

    #[cfg(feature = "otel")]
    telemetry::observe({
        let desks = service.desks.clone();
        move || {
            let health =
                |(rig, desk): (Arc<str>, Arc<CommandDesk>)| (rig, desk.health((0, MonoTime::default())));
            desks.of(None).into_iter().map(health).collect()
        }
    });

    let mut closed = Ok(());
    let signalled = loop {
        tokio::select! {
            biased;
            ending = signals.next() => break ending.name,
            kept = keeping.join_next() => match kept {
                Some(kept) => closed = closed.and(end_of(kept)),
                None => break "no rig is left",
            },
        }
    };
    info!("{signalled}: closing down");
    systemd.stopping();
    end.send_replace(Some(signalled));
    while let Some(kept) = keeping.join_next().await {
        closed = closed.and(end_of(kept));
    }
    for task in tasks {
        task.abort();
    }
    info!("closed");
    closed
}

/// Starts the thread that answers stops: no task that waits or computes can keep it from running. It ends with the bus.
fn answer_stops(desks: &Desks, stops: mpsc::Receiver<Box<CommandCall>>) -> std::io::Result<()> {
    let (desks, runtime) = (desks.clone(), Handle::current());
    let answering = move || {
        let _entered = runtime.enter();
        stops::answer(&desks, stops);
    };
    thread::Builder::new().name("stops".into()).spawn(answering).map(drop)
}

/// Starts a task for each rig, which keeps it up until the service ends.
fn keep_all(rigs: Vec<Rig>, service: &Arc<Service>) -> JoinSet<Result<(), RigError>> {
    let are_several = service.config.rigs.are_several;
    let mut keeping = JoinSet::new();
    for rig in rigs {
        // With one rig its name would only lengthen each line.
        let span = if are_several { error_span!("rig", name = &*rig.name) } else { Span::none() };
        keeping.spawn(rig.keep(Arc::clone(service)).instrument(span));
    }
    keeping
}

/// How a rig has ended.
fn end_of(kept: Result<Result<(), RigError>, JoinError>) -> Result<(), ServiceError> {
    match kept {
        Ok(ended) => Ok(ended?),
        Err(panic) => {
            error!(%panic, "the keeper of a rig broke off: this is a defect of Tactus");
            Ok(())
        }
    }
}

/// The names of all rigs, served or refused.
fn names(config: &ServiceConfig) -> Vec<String> {
    let served = config.rigs.served.iter().map(|files| files.rig.name.clone());
    let mut names: Vec<_> = served.chain(config.rigs.refused.iter().map(|rig| rig.name.clone())).collect();
    names.sort();
    names.dedup();
    names
}

fn certificates(tls: TlsSection) -> TlsConfig {
    let TlsSection { authority, certificate, key, commanders, readers, check_certificate, check_key } = tls;
    TlsConfig { authority, certificate, key, commanders, readers, check: check_certificate.zip(check_key) }
}
