//! The dashboard: a page with the live image, the stage, the run, and STOP.
//!
//! It is a separate process without devices or files, and an ordinary client of the bus. Input from browsers never reaches
//! the process that acquires frames.
//!
//! | path | what |
//! |---|---|
//! | `GET /` | the page; its script and style have their own paths |
//! | `GET /live` | server-sent events, each with the whole view as JSON, at most 20 per second |
//! | `POST /stop`, `/pause`, `/resume`, `/reset` | sends the command of that name to the service |
//!
//! A slow browser misses views and delays nothing. Requests from pages of other sites are refused.

mod guard;
mod live;
mod site;
mod view;

use std::net::SocketAddr;
use std::process::ExitCode;

use anyhow::Context;
use clap::Parser;
use sd_notify::NotifyState;
use tactus_bus::Endpoint;
use tactus_log::LogFormat;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tracing::{error, info};

use live::Live;

/// The dashboard of Tactus.
#[derive(Debug, Parser)]
#[command(name = "tactus-web", version, about)]
struct Options {
    /// Address of the service.
    #[arg(long, env = "TACTUS_ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    endpoint: Endpoint,
    /// Name of the rig, if several are served.
    #[arg(long, env = "TACTUS_RIG")]
    rig: Option<String>,
    /// Address of the page. Whoever reaches it can stop, pause, resume and reset; the default is reachable from this
    /// machine only.
    #[arg(long, env = "TACTUS_WEB_LISTEN", default_value = "127.0.0.1:7480")]
    listen: SocketAddr,
    /// Host name that browsers of other machines use for the page, for example behind a proxy; several with commas.
    #[arg(long, env = "TACTUS_WEB_HOST", value_name = "NAME", value_delimiter = ',')]
    host: Vec<String>,
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
        let live = Live::start(options.endpoint, options.rig);
        let site = site::site(live, guard::Hosts::new(address, options.host));
        let mut terminated = signal(SignalKind::terminate()).context("SIGTERM")?;
        info!("http://{address}");
        // Without systemd this does nothing.
        let _told = sd_notify::notify(&[NotifyState::Ready]);
        tokio::select! {
            served = axum::serve(listener, site) => served.context("the server ended"),
            _ = terminated.recv() => Ok(()),
            interrupted = tokio::signal::ctrl_c() => interrupted.context("SIGINT"),
        }
    })
}
