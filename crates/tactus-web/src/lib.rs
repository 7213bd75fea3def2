//! The dashboard: a page with the live image, the stage, the run, its log, and STOP.
//!
//! It is a separate process without devices, and an ordinary client of the bus. Of files it reads recordings, and writes notes beside them.
//! Input from browsers never reaches the process that acquires frames.
//!
//! | path | what |
//! |---|---|
//! | `GET /` | the page; its scripts and style have their own paths |
//! | `GET /live` | server-sent events: `rig`, `view`, `log` and `frame`, first all of them, then each when it changes |
//! | `GET /history` | the frames of the last minutes, as numbers |
//! | `GET /foxglove` | with the feature `foxglove`: live channels for Foxglove and its relatives, over a WebSocket |
//! | `GET /metrics` | connections, frames, losses, run, safety and tip, as Prometheus reads them |
//! | `GET /runs` | the recorded runs with their tags and notes |
//! | `GET /runs/compare/ID,ID` | in which settings and results runs differ |
//! | `GET /runs/ID/report`, `/runs/ID/parquet`, `/csv`, `/npz`, `/mcap` | the report of a run, its table, its recording |
//! | `POST /stop` | stops the rig, whether the service is ready or not |
//! | `POST /experiments` | the list of experiments with their parameters: needs the header `x-tactus-token`, as all that follow |
//! | `POST /plan` | a dry run on the rig's twin, in the service |
//! | `POST /runs/ID/notes`, `/runs/ID/again` | writes tags and note of a run; makes it again |
//! | `POST /zero` | a new zero for all viewers, with the tip up and no run in progress |
//! | `POST /run`, `/move`, `/pause`, `/resume`, `/reset` | sends a command to the service, with the lease; `x-take-over` has the reason to take over the lease |
//!
//! This process keeps the zero and the last minutes, so that all pages show the same numbers, whenever they were opened. It writes
//! each message once, however many pages there are. A slow browser misses messages and delays nothing. Requests from pages of other sites are refused. Connections that ask nothing are
//! closed to make room, so that a stop always finds a place.

mod board;
mod feed;
#[cfg(feature = "foxglove")]
mod foxglove;
mod guard;
mod live;
mod metrics;
mod order;
mod page;
mod runs;
mod server;
mod site;
mod token;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Context;
use clap::{CommandFactory, Parser};
use sd_notify::NotifyState;
use tactus_bus::Endpoint;
use tactus_log::LogFormat;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tracing::{error, info};

use live::Live;
use runs::Runs;
use token::Token;

/// The dashboard of Tactus.
#[derive(Debug, Parser)]
#[command(name = "tactus-web", version, about)]
struct Options {
    /// Address of the service. Default: the socket of the installed service whenever it is there, else loopback.
    #[arg(long, env = "TACTUS_ENDPOINT")]
    endpoint: Option<Endpoint>,
    /// Name of the rig, if several are served.
    #[arg(long, env = "TACTUS_RIG")]
    rig: Option<String>,
    /// Address of the page. Whoever reaches it can look and stop; all other commands want the token. The default is
    /// reachable from this machine only.
    #[arg(long, env = "TACTUS_WEB_LISTEN", default_value = "127.0.0.1:7480")]
    listen: SocketAddr,
    /// Host name that browsers of other machines use for the page, for example behind a proxy; several with commas.
    #[arg(long, env = "TACTUS_WEB_HOST", value_name = "NAME", value_delimiter = ',')]
    host: Vec<String>,
    /// Site whose pages may show the live channels, besides Foxglove's own and this machine's; several with commas.
    #[cfg(feature = "foxglove")]
    #[arg(long, env = "TACTUS_WEB_VIEWER_ORIGIN", value_name = "ORIGIN", value_delimiter = ',')]
    viewer_origin: Vec<String>,
    /// Folder of the recordings. Default: that of the installed service if it is there, else `runs`.
    #[arg(long, env = "TACTUS_WEB_RUNS", value_name = "DIR")]
    runs: Option<PathBuf>,
    /// File for the token of commands, new at each start, which its group may read. Default: `token` in systemd's runtime
    /// directory; without one the token is printed as a part of the page's address.
    #[arg(long, env = "TACTUS_WEB_TOKEN_FILE", value_name = "FILE")]
    token_file: Option<PathBuf>,
}

/// The options of `tactus-web`.
pub fn command() -> clap::Command {
    Options::command()
}

/// Runs `tactus-web` with the process's arguments.
pub fn main() -> ExitCode {
    let options = Options::parse();
    let _log = tactus_log::start(LogFormat::Text, "info,zenoh=error");
    match run(options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            error!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Serves until SIGTERM or Ctrl-C.
fn run(options: Options) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("cannot start the async runtime")?;
    runtime.block_on(async {
        let listener = TcpListener::bind(options.listen).await.with_context(|| {
            format!("cannot listen on {}: choose another address with --listen", options.listen)
        })?;
        let address = listener.local_addr().context("cannot read the listening address")?;
        let token = Token::new().context("cannot make a token")?;
        let folder = std::env::var_os("RUNTIME_DIRECTORY").map(|folder| PathBuf::from(folder).join("token"));
        if let Some(file) = options.token_file.or(folder) {
            token.write(&file).with_context(|| file.display().to_string())?;
            info!("http://{address}/#TOKEN: the token is in {}", file.display());
        } else {
            info!("http://{address}/{}", token.fragment());
        }
        let installed = Some(PathBuf::from(tactus_runs::INSTALLED)).filter(|folder| folder.is_dir());
        let runs = Runs::new(options.runs.or(installed).unwrap_or_else(|| "runs".into()));
        let live = Live::start(options.endpoint, options.rig);
        let hosts = guard::Hosts::new(address, options.host);
        let site = site::site(live.clone(), runs, Arc::clone(&hosts), Arc::new(token));
        #[cfg(feature = "foxglove")]
        let site = site.merge(foxglove::site(live, hosts, options.viewer_origin));
        let mut terminated = signal(SignalKind::terminate()).context("SIGTERM")?;
        // Without systemd this does nothing.
        let _told = sd_notify::notify(&[NotifyState::Ready]);
        tokio::select! {
            () = server::serve(listener, site) => Ok(()),
            _ = terminated.recv() => Ok(()),
            interrupted = tokio::signal::ctrl_c() => interrupted.context("SIGINT"),
        }
    })
}
