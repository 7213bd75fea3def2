//! A stage with a driver: the side that callers use.

use std::sync::Arc;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_safety::{HomingPermit, Permit};
use tactus_schema::rig::StageProtocol;
use tactus_schema::{MonoTime, pb};
use tactus_wire::stage::{Controller, Session};
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::Instant;
use tracing::Instrument as _;

use super::driver::{CommandRequest, Driver, Progress, StageCommand};
use super::guard::{Guard, Heartbeat};
use super::stop::StopSwitch;
use super::{Stage, StageError, grbl_config, zaber_config};
use crate::transport::Connect;
use crate::{Clock, DeviceError, ErrorKind};

/// Reports that may wait for the reader: five seconds of motion.
const REPORTS_MAX: usize = 256;

/// Commands that may wait for the driver.
const REQUESTS_MAX: usize = 8;

/// A stage that is driven by a task of its own.
#[derive(Debug)]
pub struct DrivenStage {
    device: String,
    requests: mpsc::Sender<CommandRequest>,
    stop: Arc<StopSwitch>,
    watched: watch::Sender<Option<Instant>>,
    heartbeat: Heartbeat,
    state: watch::Receiver<pb::StageState>,
    connection: watch::Receiver<Connection>,
}

/// State of the link to the controller.
#[derive(Debug, Clone)]
pub enum Connection {
    /// The driver is trying to connect; the error of the last attempt, if there was one.
    Seeking(Option<Arc<DeviceError>>),
    /// The controller answers.
    Connected(Controller),
}

/// Options of a stage that do not depend on its protocol.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageOptions {
    /// A move is done when the stage stands within this distance of the target.
    pub tolerance_mm: f64,
    /// True if no physical stage moves.
    pub simulated: bool,
}

impl DrivenStage {
    /// Starts the task that owns the stage. Returns the stage and the channel of its reports. The task ends when the stage
    /// is dropped.
    ///
    /// While the stage does not answer, commands fail at once with [`StageError::Device`]. A command is refused while
    /// another is under way. A command given during a stop waits until the stage stands still. Dropping a command's future
    /// does not end the command.
    ///
    /// A task that does not wait for the stage must drain the reports: when the channel is full, the driver stops reading
    /// from the device.
    pub fn start(
        connect: Box<dyn Connect>,
        protocol: &StageProtocol,
        options: StageOptions,
        clock: Clock,
    ) -> (Arc<Self>, mpsc::Receiver<pb::StageState>) {
        match protocol {
            StageProtocol::Grbl(axes) => {
                let config = grbl_config(axes, options.tolerance_mm);
                Self::spawn(connect, move || tactus_wire::grbl::Session::new(config), options, clock)
            }
            StageProtocol::Zaber(axes) => {
                let config = zaber_config(axes, options.tolerance_mm);
                let begin = move || tactus_wire::zaber::Session::new(config.clone());
                Self::spawn(connect, begin, options, clock)
            }
        }
    }

    /// State of the link to the controller, updated when it changes.
    pub fn connection(&self) -> watch::Receiver<Connection> {
        self.connection.clone()
    }

    /// Starts the driver; `begin` makes the session of each connection.
    fn spawn<S, E>(
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
        // Bounded, and no report is lost: when it is full, the driver reads nothing from the device until there is room.
        // A stop is still sent at once.
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
        let (watched, is_watched) = watch::channel(None);
        let device = format!("stage on {connect}");
        let guard = Guard::new(clock);
        let heartbeat = guard.heartbeat();
        let driver = Driver {
            connect: connect.into(),
            begin: Box::new(move || begin().map_err(|error| error.to_string())),
            options,
            clock,
            requests,
            stop: Arc::clone(&stop),
            watched: is_watched,
            reports,
            latest,
            connection: connected,
            guard,
            progress: Progress::default(),
        };
        // Its log says of which rig it is.
        tokio::spawn(driver.run().in_current_span());
        (
            Arc::new(Self { device, requests: sender, stop, watched, heartbeat, state, connection }),
            all_reports,
        )
    }

    fn command(&self, command: StageCommand) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        // Counted when the command is given, so that a stop before the command begins ends it, too.
        let stops_before = self.stop.count();
        async move {
            let (reply, result) = oneshot::channel();
            let gone = || DeviceError::new(&self.device, ErrorKind::Disconnected, "its driver has ended");
            self.requests.send(CommandRequest { command, stops_before, reply }).await.map_err(|_| gone())?;
            result.await.map_err(|_| gone())?
        }
        .boxed()
    }
}

impl Stage for DrivenStage {
    fn state(&self) -> watch::Receiver<pb::StageState> {
        self.state.clone()
    }

    fn home(&self, permit: HomingPermit) -> BoxFuture<'_, Result<(), StageError>> {
        self.command(StageCommand::Home(permit)).map(|result| result.map(|_| ())).boxed()
    }

    fn move_to(&self, permit: Permit) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        self.command(StageCommand::MoveTo(permit))
    }

    fn look(&self) -> BoxFuture<'_, Result<[f64; 3], StageError>> {
        self.command(StageCommand::Look)
    }

    fn stop(&self) {
        self.stop.press();
    }

    fn watch(&self) {
        self.watched.send_replace(Some(Instant::now()));
    }

    fn driven(&self) -> MonoTime {
        self.heartbeat.last()
    }

    fn clear_alarm(&self) -> BoxFuture<'_, Result<(), StageError>> {
        self.command(StageCommand::ClearAlarm).map(|result| result.map(|_| ())).boxed()
    }
}

#[cfg(test)]
#[path = "driven_tests.rs"]
mod tests;
