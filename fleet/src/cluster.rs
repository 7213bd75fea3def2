//! The same queries on several machines: a scheduler and executors of Ballista, which know the functions and tables of a fleet.
//!
//! The program that asks sends the scheduler a plan. The scheduler cuts it into tasks, which executors fetch. All of them read the fleet's
//! files by themselves, so the fleet is at an address that all of them reach.

mod codec;

use std::{
    io,
    net::{IpAddr, SocketAddr},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use anyhow::Context as _;
use ballista::extension::{SessionConfigExt as _, SessionContextExt as _};
use ballista_core::{
    config::TaskSchedulingPolicy, registry::BallistaFunctionRegistry, utils::default_session_builder,
};
use ballista_executor::executor_process::{ExecutorProcessConfig, start_executor_process};
use ballista_scheduler::{
    cluster::BallistaCluster,
    config::SchedulerConfig,
    scheduler_process::{create_scheduler, start_grpc_service_with_listener},
};
use datafusion::{
    error::Result,
    execution::SessionStateBuilder,
    prelude::{SessionConfig, SessionContext},
};
use datafusion_proto::protobuf::{LogicalPlanNode, PhysicalPlanNode};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{TcpListener, TcpStream},
    signal::unix::{SignalKind, signal},
    time::{sleep, timeout},
};
use url::Url;

use crate::{Place, query::register_functions};
use codec::Codec;

/// A session whose queries run on a cluster.
pub(crate) async fn session(scheduler: SocketAddr, config: SessionConfig) -> Result<SessionContext> {
    let config = with_codec(config.upgrade_for_ballista());
    let state = SessionStateBuilder::new().with_config(config).with_default_features().build();
    SessionContext::remote_with_state(&format!("df://{scheduler}"), state).await
}

/// Why a cluster cannot be asked.
#[derive(Debug, thiserror::Error)]
enum NoCluster {
    #[error("no scheduler answers at {at}: `tactus fleet scheduler --listen {at}` starts one there")]
    Scheduler { at: SocketAddr, source: io::Error },
    #[error("the scheduler at {at} has no executor: `tactus fleet executor --scheduler {at}` starts one")]
    Executor { at: SocketAddr },
    #[error(
        "{fleet} is in an object store: a cluster reads a folder that all its machines have at the same path. Ask without --cluster"
    )]
    NoFolder { fleet: Url },
}

/// Whoever needs longer to answer is not in the same network.
const PATIENCE: Duration = Duration::from_secs(5);

/// Refuses a fleet that a cluster cannot read, and a cluster that is not there. A query would wait for its executors for ever.
pub(crate) async fn check(scheduler: SocketAddr, place: &Place) -> anyhow::Result<()> {
    if place.url().scheme() != "file" {
        return Err(NoCluster::NoFolder { fleet: place.url().clone() }.into());
    }
    check_listens(scheduler).await?;
    // Executors may have been started just now.
    let ready = async {
        while !has_executor(scheduler).await? {
            sleep(Duration::from_millis(50)).await;
        }
        Ok(())
    };
    timeout(PATIENCE, ready).await.unwrap_or(Err(NoCluster::Executor { at: scheduler }.into()))
}

async fn check_listens(scheduler: SocketAddr) -> anyhow::Result<()> {
    let connected = timeout(PATIENCE, TcpStream::connect(scheduler)).await;
    let connected = connected.map_err(io::Error::from).flatten();
    connected.map_err(|source| NoCluster::Scheduler { at: scheduler, source })?;
    Ok(())
}

/// Asks the scheduler, which tells it to probes by HTTP.
async fn has_executor(scheduler: SocketAddr) -> io::Result<bool> {
    let mut scheduler = TcpStream::connect(scheduler).await?;
    scheduler.write_all(b"GET /readyz HTTP/1.0\r\n\r\n").await?;
    let mut answer = Vec::new();
    scheduler.take(1 << 10).read_to_end(&mut answer).await?;
    Ok(answer.split(|byte| *byte == b' ').nth(1) == Some(b"200"))
}

/// Runs a scheduler until it is stopped. `ready` is told where it listens. An executor that is silent for `lost_s` seconds is given up; others
/// do its tasks again.
pub(crate) async fn schedule(
    listen: SocketAddr,
    lost_s: u64,
    ready: impl FnOnce(SocketAddr),
) -> anyhow::Result<()> {
    let stopped = hear_stop()?;
    let listener = bind(listen).await?;
    let listen = listener.local_addr()?;
    let config = SchedulerConfig {
        bind_host: host(listen.ip()),
        bind_port: listen.port(),
        scheduling_policy: TaskSchedulingPolicy::PullStaged,
        executor_timeout_seconds: lost_s,
        no_executors_grace_period_seconds: lost_s,
        expire_dead_executor_interval_seconds: 1,
        override_config_producer: Some(Arc::new(config)),
        override_session_builder: Some(Arc::new(|config| {
            let session = SessionContext::new_with_state(default_session_builder(config)?);
            register_functions(&session);
            Ok(session.state())
        })),
        override_logical_codec: Some(Arc::new(Codec::default())),
        override_physical_codec: Some(Arc::new(Codec::default())),
        ..SchedulerConfig::default()
    };
    let cluster = BallistaCluster::new_from_config(&config).await?;
    let scheduler = create_scheduler::<LogicalPlanNode, PhysicalPlanNode>(cluster, Arc::new(config)).await?;
    ready(listen);
    tokio::select! {
        served = start_grpc_service_with_listener(listener, scheduler) => Ok(served?),
        () = stopped => Ok(()),
    }
}

/// What an executor is told.
#[derive(Debug)]
pub(crate) struct ExecutorOptions {
    /// The scheduler.
    pub(crate) scheduler: SocketAddr,
    /// Where it hands out parts of answers to other executors.
    pub(crate) listen: SocketAddr,
    /// How many tasks it does at a time.
    pub(crate) threads: usize,
    /// Memory for sorts, groups and joins of all tasks.
    pub(crate) memory_bytes: u64,
    /// Folder for parts of answers, and for what does not fit in memory.
    pub(crate) folder: PathBuf,
}

/// Runs an executor until it is stopped. `ready` is told where it listens.
pub(crate) async fn execute(options: ExecutorOptions, ready: impl FnOnce(SocketAddr)) -> anyhow::Result<()> {
    /// So long it may take to tell the scheduler that it ends. What it computes meanwhile, others do again.
    const FAREWELL: Duration = Duration::from_secs(2);
    let stopped = hear_stop()?;
    check_listens(options.scheduler).await?;
    // Ballista binds by itself, and would end without a word if it could not.
    let listen = bind(options.listen).await?.local_addr()?;
    let session = SessionContext::new();
    register_functions(&session);
    let config = ExecutorProcessConfig {
        bind_host: host(listen.ip()),
        external_host: Some(host(listen.ip())),
        port: listen.port(),
        scheduler_host: host(options.scheduler.ip()),
        scheduler_port: options.scheduler.port(),
        vcores: options.threads,
        task_scheduling_policy: TaskSchedulingPolicy::PullStaged,
        work_dir: Some(text(&options.folder)?),
        // To Ballista, 0 is no limit.
        memory_pool_size: Some(options.memory_bytes.max(1)),
        override_config_producer: Some(Arc::new(config)),
        override_function_registry: Some(Arc::new(BallistaFunctionRegistry::from(&session.state()))),
        override_logical_codec: Some(Arc::new(Codec::default())),
        override_physical_codec: Some(Arc::new(Codec::default())),
        ..ExecutorProcessConfig::default()
    };
    ready(listen);
    let gone = async {
        stopped.await;
        sleep(FAREWELL).await;
    };
    tokio::select! {
        // Ballista hears signals, too, and tells the scheduler. But then it goes on with tasks, and takes new ones.
        ended = start_executor_process(Arc::new(config)) => Ok(ended?),
        () = gone => Ok(()),
    }
}

async fn bind(listen: SocketAddr) -> anyhow::Result<TcpListener> {
    TcpListener::bind(listen).await.with_context(|| format!("{listen} cannot be listened on"))
}

/// Hears Ctrl-C and SIGTERM from now on; ends with the first.
fn hear_stop() -> io::Result<impl Future<Output = ()>> {
    let mut interrupted = signal(SignalKind::interrupt())?;
    let mut terminated = signal(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = interrupted.recv() => (),
            _ = terminated.recv() => (),
        }
    })
}

/// An address as it stands before `:PORT`.
fn host(ip: IpAddr) -> String {
    match ip {
        IpAddr::V4(ip) => ip.to_string(),
        IpAddr::V6(ip) => format!("[{ip}]"),
    }
}

fn config() -> SessionConfig {
    with_codec(SessionConfig::new_with_ballista())
}

fn with_codec(config: SessionConfig) -> SessionConfig {
    config
        .with_ballista_logical_extension_codec(Arc::new(Codec::default()))
        .with_ballista_physical_extension_codec(Arc::new(Codec::default()))
}

fn text(folder: &Path) -> anyhow::Result<String> {
    folder.to_str().map(str::to_owned).with_context(|| format!("{} is not UTF-8", folder.display()))
}
