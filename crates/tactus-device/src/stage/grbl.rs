//! The driver of stages that speak `grbl`.

mod driver;
mod stop;

use std::sync::Arc;

use driver::{Command, Driver, Progress, Request};
use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use stop::StopSwitch;
use tactus_schema::pb;
use tokio::sync::{mpsc, oneshot, watch};

use super::{Stage, StageError, Target};
use crate::transport::Connect;
use crate::{Clock, DeviceError, ErrorKind};

/// Reports that may wait to be taken: twelve seconds of them in motion.
const REPORTS_MAX: usize = 256;

/// Commands that may wait for the one before them to be looked at.
const REQUESTS_MAX: usize = 8;

/// A stage that speaks `grbl`.
#[derive(Debug)]
pub struct GrblStage {
    device: String,
    requests: mpsc::Sender<Request>,
    stop: Arc<StopSwitch>,
    state: watch::Receiver<pb::StageState>,
}

/// What the driver is told of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrblOptions {
    /// A move is done when the controller stands within this of the target.
    pub tolerance_mm: f64,
    /// True if no physical stage moves.
    pub simulated: bool,
}

impl GrblStage {
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
        options: GrblOptions,
        clock: Clock,
    ) -> (Arc<dyn Stage>, mpsc::Receiver<pb::StageState>) {
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
        let stop = Arc::new(StopSwitch::default());
        let device = format!("stage on {connect}");
        let driver = Driver {
            connect: connect.into(),
            options,
            clock,
            requests,
            stop: Arc::clone(&stop),
            reports,
            latest,
            progress: Progress::default(),
        };
        tokio::spawn(driver.run());
        (Arc::new(Self { device, requests: sender, stop, state }), all_reports)
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

impl Stage for GrblStage {
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
#[path = "grbl_tests.rs"]
mod tests;
