//! A stage with a driver: what callers hold of it.

use std::sync::Arc;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_schema::pb;
use tactus_schema::rig::StageProtocol;
use tactus_wire::stage::{Controller, Session};
use tokio::sync::{mpsc, oneshot, watch};

use super::driver::{Command, Driver, Progress, Request};
use super::stop::StopSwitch;
use super::{Stage, StageError, Target, grbl_config, zaber_config};
use crate::transport::Connect;
use crate::{Clock, DeviceError, ErrorKind};

/// Reports that may wait to be taken: twelve seconds of them in motion.
const REPORTS_MAX: usize = 256;

/// Commands that may wait for the one before them to be looked at.
const REQUESTS_MAX: usize = 8;

/// A stage whose controller a driver of its own talks to.
#[derive(Debug)]
pub struct DrivenStage {
    device: String,
    requests: mpsc::Sender<Request>,
    stop: Arc<StopSwitch>,
    state: watch::Receiver<pb::StageState>,
    connection: watch::Receiver<Connection>,
}

/// How the driver stands with the controller.
#[derive(Debug, Clone)]
pub enum Connection {
    /// It is being looked for; why it is not there, once that is known.
    Seeking(Option<Arc<DeviceError>>),
    /// It answers.
    Connected(Controller),
}

/// What the driver is told of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageOptions {
    /// A move is done when the controller stands within this of the target.
    pub tolerance_mm: f64,
    /// True if no physical stage moves.
    pub simulated: bool,
}

impl DrivenStage {
    /// Starts the task that owns the stage, and gives the stage and every report of it. The task ends when
    /// the stage is dropped.
    ///
    /// Until the stage answers, and while it is gone, commands fail at once as
    /// [`StageError::Device`]. A command that is given while another is in hand is refused; one that is given
    /// while a stop is under way waits until the stage stands. To drop the future of a command does not end it.
    ///
    /// The reports must be drained by a task that does not wait for the stage: see the note on the channel.
    pub fn start(
        connect: Box<dyn Connect>,
        protocol: &StageProtocol,
        options: StageOptions,
        clock: Clock,
    ) -> (Arc<Self>, mpsc::Receiver<pb::StageState>) {
        match protocol {
            StageProtocol::Grbl(axes) => {
                let config = grbl_config(axes, options.tolerance_mm);
                Self::speak(connect, move || tactus_wire::grbl::Session::new(config), options, clock)
            }
            StageProtocol::Zaber(axes) => {
                let config = zaber_config(axes, options.tolerance_mm);
                let begin = move || tactus_wire::zaber::Session::new(config.clone());
                Self::speak(connect, begin, options, clock)
            }
        }
    }

    /// How the driver stands with the controller, now and as it changes.
    pub fn connection(&self) -> watch::Receiver<Connection> {
        self.connection.clone()
    }

    /// Starts the driver; `begin` makes the session of each connection.
    fn speak<S, E>(
        connect: Box<dyn Connect>,
        begin: impl Fn() -> Result<S, E> + Send + Sync + 'static,
        options: StageOptions,
        clock: Clock,
    ) -> (Arc<Self>, mpsc::Receiver<pb::StageState>)
    where
        S: Session + Send + 'static,
        S::Error: Send + Sync,
        E: std::error::Error,
    {
        // Bounded, and no report is ever lost: when it is full the driver takes nothing more from the device until
        // there is room. A stop is still sent at once.
        let (reports, all_reports) = mpsc::channel(REPORTS_MAX);
        // Bounded: callers wait for room.
        let (sender, requests) = mpsc::channel(REQUESTS_MAX);
        let gone = pb::StageState {
            status: pb::StageStatus::Disconnected.into(),
            simulated: options.simulated,
            ..Default::default()
        };
        let (latest, state) = watch::channel(gone);
        let (connected, connection) = watch::channel(Connection::Seeking(None));
        let stop = Arc::new(StopSwitch::default());
        let device = format!("stage on {connect}");
        let driver = Driver {
            connect: connect.into(),
            begin: Box::new(move || begin().map_err(|error| error.to_string())),
            options,
            clock,
            requests,
            stop: Arc::clone(&stop),
            reports,
            latest,
            connection: connected,
            progress: Progress::default(),
        };
        tokio::spawn(driver.run());
        (Arc::new(Self { device, requests: sender, stop, state, connection }), all_reports)
    }

    fn command(&self, command: Command) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        // Taken when the command is given: a stop that comes before it is carried out is meant for it too.
        let stops_before = self.stop.count();
        async move {
            let (reply, result) = oneshot::channel();
            let gone = || DeviceError::new(&self.device, ErrorKind::Disconnected, "its driver has ended");
            self.requests.send(Request { command, stops_before, reply }).await.map_err(|_| gone())?;
            result.await.map_err(|_| gone())?
        }
        .boxed()
    }
}

impl Stage for DrivenStage {
    fn state(&self) -> watch::Receiver<pb::StageState> {
        self.state.clone()
    }

    fn home(&self) -> BoxFuture<'_, Result<(), StageError>> {
        self.command(Command::Home).map(|result| result.map(|_| ())).boxed()
    }

    fn move_to(&self, target: Target) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        self.command(Command::MoveTo(target))
    }

    fn stop(&self) {
        self.stop.press();
    }

    fn clear_alarm(&self) -> BoxFuture<'_, Result<(), StageError>> {
        self.command(Command::ClearAlarm).map(|result| result.map(|_| ())).boxed()
    }
}

#[cfg(test)]
#[path = "driven_tests.rs"]
mod tests;
