//! The dashboard: a page with the live image, the stage, the run, and STOP.
//!
//! It is a process of its own, without devices or files, and a client of the bus like any other: whatever a browser
//! sends, nothing of it is parsed where frames are acquired.
//!
//! | path | what |
//! |---|---|
//! | `GET /` | the page; its script and style beside it |
//! | `GET /live` | server-sent events, each the whole view as JSON, at most 20 a second |
//! | `POST /stop`, `/pause`, `/resume`, `/reset` | the command of that name, for the service |
//!
//! A browser that is slow misses views, never delays one. Requests from pages of other sites are refused.

mod guard;
mod live;
mod site;
mod view;

use std::io::{self, IsTerminal};
use std::net::SocketAddr;
use std::process::ExitCode;

use anyhow::Context;
use clap::Parser;
use sd_notify::NotifyState;
use tactus_bus::Endpoint;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tracing::{error, info};
use tracing_subscriber::EnvFilter;

use live::Live;

/// The dashboard of Tactus.
#[derive(Debug, Parser)]
#[command(name = "tactus-web", version, about)]
struct Options {
    /// Where the service's bus is.
    #[arg(long, env = "TACTUS_ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    endpoint: Endpoint,
    /// The rig, if there are several.
    #[arg(long, env = "TACTUS_RIG")]
    rig: Option<String>,
    /// Where browsers find the page. Whoever reaches it can stop, pause and reset: only this machine, unless you say otherwise.
    #[arg(long, env = "TACTUS_WEB_LISTEN", default_value = "127.0.0.1:7480")]
    listen: SocketAddr,
    /// A name under which browsers of other machines ask for the page, as behind a proxy; several with commas.
    #[arg(long, env = "TACTUS_WEB_HOST", value_name = "NAME", value_delimiter = ',')]
    host: Vec<String>,
}

/// The program.
pub fn main() -> ExitCode {
    let options = Options::parse();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info,zenoh=error"));
    let lines = tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr);
    lines.with_ansi(io::stderr().is_terminal()).init();
    match run(options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            error!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Serves until it is told to end.
fn run(options: Options) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("the system gives no runtime")?;
    runtime.block_on(async {
        let listener = TcpListener::bind(options.listen).await.with_context(|| {
            format!("cannot listen on {}: choose another place with --listen", options.listen)
        })?;
        let address = listener.local_addr().context("the place that it listens on")?;
        let live = Live::start(options.endpoint, options.rig);
        let site = site::site(live, guard::Hosts::new(address, options.host));
        let mut terminated = signal(SignalKind::terminate()).context("SIGTERM")?;
        info!("http://{address}");
        // Nothing happens where there is no systemd.
        let _told = sd_notify::notify(&[NotifyState::Ready]);
        tokio::select! {
            served = axum::serve(listener, site) => served.context("the server ended"),
            _ = terminated.recv() => Ok(()),
            interrupted = tokio::signal::ctrl_c() => interrupted.context("SIGINT"),
        }
    })
}
