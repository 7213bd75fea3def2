//! `stage check`: whether a rig's stage is the one that the rig file describes, and moves as it reports.
//!
//! It opens the stage itself, without a service and without the sensor. It relies on the controller's reports. A stage
//! below the safe height rises to it; there each axis moves by [`STEP_MM`] and back.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tactus_device::{Clock, Connection, Controller, DrivenStage, SensorCodec, Stage, StageError, Target};
use tactus_safety::Supervisor;
use tactus_schema::Rig;
use tactus_schema::pb::{StageState, StageStatus};
use tactus_schema::rig::{Service, Transport};
use tactus_virtual::{RigControl, Truth, VirtualRig};
use tokio::sync::mpsc;
use tokio::time::{Instant, timeout};

use crate::signals::EndingSignals;
use crate::{devices, virtual_time};

/// Distance that each axis moves.
pub const STEP_MM: f64 = 0.01;

/// An axis that reports less than this share of its distance has not moved.
const WAY_SHARE_MIN: f64 = 0.5;

/// Timeout for the controller's first answer. A driver that finds no device reports that earlier.
const PATIENCE: Duration = Duration::from_secs(30);

/// Names of the axes.
const NAMES: [&str; 3] = ["x", "y", "z"];

/// What a check found.
#[derive(Debug, Clone, PartialEq)]
pub struct StageCheck {
    /// The controller that answered.
    pub controller: Option<Controller>,
    /// Last reported position, robot frame.
    pub position_mm: [f64; 3],
    /// True if the stage knows its position.
    pub is_homed: bool,
    /// The moves that were tried.
    pub moves: Vec<CheckedMove>,
    /// Why the check did not finish, or what must be done first.
    pub trouble: Option<String>,
}

/// A move of the check.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedMove {
    /// Name of the moving axis.
    pub axis: &'static str,
    /// Target on this axis.
    pub asked_mm: f64,
    /// Reported position on this axis at the end; `None` if it did not arrive.
    pub reported_mm: Option<f64>,
    /// Distance of the reported position from the target, over all axes.
    pub error_mm: Option<f64>,
    /// Duration of the move.
    pub took: Duration,
    /// What is wrong with the move; `None` if nothing is.
    pub trouble: Option<String>,
}

/// Why there was no check.
#[derive(Debug, thiserror::Error)]
pub enum StageCheckError {
    /// The rig describes data, not a service.
    #[error(
        "rig {rig:?} has no stage: a rig file for a service needs envelope, motion, policy, sensor and stage"
    )]
    #[expect(missing_docs, reason = "the message says what each field is")]
    NoService { rig: String },
    /// The system provided no runtime.
    #[error("no check: {0}")]
    System(#[from] io::Error),
}

impl StageCheck {
    /// True if the stage is connected, knows its position, and made every move.
    pub fn is_good(&self) -> bool {
        self.trouble.is_none() && self.moves.iter().all(|one| one.trouble.is_none())
    }
}

impl CheckedMove {
    /// Judges a move along one axis by its reported end.
    fn judge(axis: usize, from_mm: [f64; 3], asked_mm: [f64; 3], took: Duration, end: Ended) -> Self {
        let mut checked = Self {
            axis: NAMES[axis],
            asked_mm: asked_mm[axis],
            reported_mm: None,
            error_mm: None,
            took,
            trouble: None,
        };
        match end {
            Err(error) => checked.trouble = Some(error.to_string()),
            Ok(reached_mm) => {
                let (way_mm, asked_way_mm) =
                    (reached_mm[axis] - from_mm[axis], asked_mm[axis] - from_mm[axis]);
                if way_mm * asked_way_mm.signum() < WAY_SHARE_MIN * asked_way_mm.abs() {
                    // The rig's tolerance may be greater than the distance.
                    checked.trouble = Some(format!(
                        "it reports a move of {:+.1} um instead of {:+.1} um: it did not move, or moved the wrong way",
                        way_mm * 1000.0,
                        asked_way_mm * 1000.0
                    ));
                }
                checked.reported_mm = Some(reached_mm[axis]);
                checked.error_mm = Some(distance_mm(reached_mm, asked_mm));
            }
        }
        checked
    }
}

/// End of a move: the reached position.
type Ended = Result<[f64; 3], StageError>;

/// Checks the stage of a rig; `home` homes it first. An embedded stage is virtual and runs in virtual time; `started` is
/// called with its control. Blocks until the end. A signal that would end the program stops the stage and ends the check.
///
/// # Errors
/// [`StageCheckError`] if there was no check at all; its result is the [`StageCheck`].
pub fn run(rig: &Rig, home: bool, started: impl FnOnce(&RigControl)) -> Result<StageCheck, StageCheckError> {
    let Some(service) = &rig.service else {
        return Err(StageCheckError::NoService { rig: rig.name.clone() });
    };
    if service.stage.transport != Transport::Embedded {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        return runtime.block_on(async {
            // Before the stage is opened, so that no signal leaves it moving.
            let signals = EndingSignals::listen()?;
            let subject = Subject { rig, service, clock: Clock::real() };
            let (stage, reports) = devices::open_stage(rig, service, || None, subject.clock);
            Ok(check_until_interrupted(stage, reports, subject, home, signals).await)
        });
    }
    let runtime = virtual_time::runtime()?;
    Ok(runtime.block_on(async {
        let seed = rig.simulation.as_ref().map_or(0, |simulation| simulation.seed);
        let mut virtual_rig = VirtualRig::of(Truth::of_rig(rig, seed), rig.covering, &SensorCodec::default());
        started(&virtual_rig.control());
        let embedded = || Some(virtual_rig.stage_connector());
        let subject = Subject { rig, service, clock: Clock::paused() };
        let (stage, reports) = devices::open_stage(rig, service, embedded, subject.clock);
        let never = AtomicBool::new(false);
        check(&stage, reports, subject, home, &never).await
    }))
}

/// What is checked.
#[derive(Debug, Clone, Copy)]
struct Subject<'a> {
    rig: &'a Rig,
    service: &'a Service,
    clock: Clock,
}

/// A signal stops the stage; the check then ends with the move that was stopped.
async fn check_until_interrupted(
    stage: Arc<DrivenStage>,
    reports: mpsc::Receiver<StageState>,
    subject: Subject<'_>,
    home: bool,
    mut signals: EndingSignals,
) -> StageCheck {
    let interrupted = AtomicBool::new(false);
    let checked = check(&stage, reports, subject, home, &interrupted);
    tokio::pin!(checked);
    loop {
        tokio::select! {
            biased;
            _ = signals.next() => {
                // First the flag, then the stop: the check reads the flag after each order to move.
                interrupted.store(true, Ordering::SeqCst);
                stage.stop();
            }
            checked = &mut checked => return checked,
        }
    }
}

async fn check(
    stage: &DrivenStage,
    mut reports: mpsc::Receiver<StageState>,
    subject: Subject<'_>,
    home: bool,
    interrupted: &AtomicBool,
) -> StageCheck {
    // The driver waits until its reports are taken. The task ends with the driver.
    tokio::spawn(async move { while reports.recv().await.is_some() {} });
    let mut checking = Checking { stage, subject, interrupted, controller: None, moves: Vec::new() };
    let trouble = checking.go_through(home).await.err();
    let Checking { controller, moves, .. } = checking;
    let state = *stage.state().borrow();
    StageCheck {
        controller,
        position_mm: [state.x_mm, state.y_mm, state.z_mm],
        is_homed: state.status() == StageStatus::Idle,
        moves,
        trouble,
    }
}

/// A check in progress.
struct Checking<'a> {
    stage: &'a DrivenStage,
    subject: Subject<'a>,
    interrupted: &'a AtomicBool,
    controller: Option<Controller>,
    moves: Vec<CheckedMove>,
}

impl Checking<'_> {
    async fn go_through(&mut self, home: bool) -> Result<(), String> {
        self.controller = Some(self.connect().await?);
        let mut state = self.stage.state();
        let reported = state.wait_for(|state| state.status() != StageStatus::Disconnected).await;
        let status = reported.map_err(|_| "the driver has ended".to_owned())?.status();
        match status {
            StageStatus::Alarm => {
                return Err(
                    "the stage is in alarm: see to it, clear it (`tactus reset` with the service, or the \
                            controller's own tools), and check again"
                        .into(),
                );
            }
            StageStatus::Idle | StageStatus::Unhomed => {}
            StageStatus::Unspecified
            | StageStatus::Disconnected
            | StageStatus::Moving
            | StageStatus::Hold
            | StageStatus::Homing => {
                return Err(format!("the stage does not stand still: it says {status:?}"));
            }
        }
        if home {
            let permit = self.supervisor().permit_homing(self.subject.clock.now().mono);
            let order = self.stage.home(permit.map_err(|denied| format!("homing: {denied}"))?);
            self.check_interrupted()?;
            order.await.map_err(|error| format!("homing: {error}"))?;
        } else if status != StageStatus::Idle {
            return Err(
                "the stage does not know where it is, so that nothing was moved: add --home, and it is \
                        homed first"
                    .into(),
            );
        }
        self.rise().await?;
        for axis in 0..3 {
            if self.subject.service.stage.protocol.has_axis(axis) {
                self.there_and_back(axis).await?;
            }
        }
        Ok(())
    }

    /// Waits for the controller, or for the first error.
    async fn connect(&self) -> Result<Controller, String> {
        let mut connection = self.stage.connection();
        let settled = connection.wait_for(|now| !matches!(now, Connection::Seeking(None)));
        match timeout(PATIENCE, settled).await {
            Err(_) => Err(format!("nothing was heard of the stage for {} s", PATIENCE.as_secs())),
            Ok(Err(_)) => Err("the driver has ended".to_owned()),
            Ok(Ok(now)) => match &*now {
                Connection::Connected(controller) => Ok(controller.clone()),
                Connection::Seeking(Some(error)) => Err(error.to_string()),
                Connection::Seeking(None) => Err("the stage is still being looked for".to_owned()),
            },
        }
    }

    /// Moves straight up to the safe height, if the stage is lower.
    async fn rise(&mut self) -> Result<(), String> {
        let motion = &self.subject.service.motion;
        let [x_mm, y_mm, z_mm] = self.position_mm();
        if z_mm >= motion.safe_height_mm - motion.tolerance_mm {
            return Ok(());
        }
        let up_mm = [x_mm, y_mm, motion.safe_height_mm];
        self.go(up_mm, motion.travel_speed_mm_per_s)
            .await?
            .map(drop)
            .map_err(|error| format!("to the safe height: {error}"))
    }

    /// Moves one axis a step, and back.
    async fn there_and_back(&mut self, axis: usize) -> Result<(), String> {
        let from_mm = self.position_mm();
        let mut there_mm = from_mm;
        there_mm[axis] += self.step_mm(axis, from_mm[axis]);
        self.checked(axis, there_mm).await?;
        self.checked(axis, from_mm).await
    }

    /// A step away from the nearer end of the envelope; z goes up if there is room.
    fn step_mm(&self, axis: usize, at_mm: f64) -> f64 {
        let envelope = &self.subject.service.envelope;
        let grows = match axis {
            0 | 1 => {
                let [least, greatest] = if axis == 0 { envelope.x_mm } else { envelope.y_mm };
                at_mm < f64::midpoint(least, greatest)
            }
            _ => at_mm + STEP_MM < envelope.z_max_mm,
        };
        if grows { STEP_MM } else { -STEP_MM }
    }

    async fn checked(&mut self, axis: usize, asked_mm: [f64; 3]) -> Result<(), String> {
        let (from_mm, began) = (self.position_mm(), Instant::now());
        let ended = self.go(asked_mm, self.subject.service.motion.load_speed_mm_per_s).await?;
        let has_failed = ended.is_err();
        self.moves.push(CheckedMove::judge(axis, from_mm, asked_mm, began.elapsed(), ended));
        if has_failed {
            return Err("a move was not made; nothing more was moved".into());
        }
        Ok(())
    }

    /// One straight move. The outer error is an interrupt before it.
    async fn go(&self, position_mm: [f64; 3], speed_mm_per_s: f64) -> Result<Ended, String> {
        // The order comes before the check of the flag, so that a stop in between comes after the order.
        let to = Target { position_mm, speed_mm_per_s };
        let permit = self
            .supervisor()
            .permit(to, self.subject.clock.now().mono)
            .map_err(|denied| denied.to_string())?;
        let order = self.stage.move_to(permit);
        self.check_interrupted()?;
        Ok(order.await)
    }

    /// Permits what the stage's last report allows.
    fn supervisor(&self) -> Supervisor {
        let mut supervisor = Supervisor::without_sensor(self.subject.rig, self.subject.service);
        if let Some(violation) = supervisor.on_report(&self.stage.state().borrow()) {
            tracing::warn!(%violation, "the stage is checked all the same");
        }
        supervisor
    }

    fn check_interrupted(&self) -> Result<(), String> {
        if self.interrupted.load(Ordering::SeqCst) { Err("interrupted".into()) } else { Ok(()) }
    }

    fn position_mm(&self) -> [f64; 3] {
        let state = self.stage.state();
        let report = state.borrow();
        [report.x_mm, report.y_mm, report.z_mm]
    }
}

fn distance_mm(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[cfg(test)]
#[path = "stage_check_tests.rs"]
mod tests;
