//! Motion of the tip: first up, then sideways, last down in small confirmed steps. Each needs the supervisor's permit.

use std::time::Duration;

use tactus_device::{StageError, Target};
use tactus_safety::{Denied, Permit, SAME_HEIGHT_MM, STEP_DOWN_MAX_MM, Void};
use tactus_schema::MonoTime;
use tactus_schema::pb::StageStatus;
use tokio::time::{sleep, timeout};

use crate::engine::Shared;
use crate::run::Broken;

/// Longest time that a stopped stage may take to stand still.
const STANDSTILL: Duration = Duration::from_secs(5);

/// Greatest number of commands of one retract that the stage may refuse or lose without having risen before it counts as failed.
const TROUBLES_MAX: u32 = 5;

/// Greatest number of stops that one retract outlasts. Somebody who stops it more often is told that the tip is not up.
const STOPS_MAX: u32 = 200;

/// Greatest number of tries for one move that ends because nobody watched it, or because the stage did not tell of it.
const UNWATCHED_MAX: u32 = 5;

/// Greatest number of homings for one reset.
const HOMINGS_MAX: u32 = 4;

/// Longest time to wait for a permit that the next frame or report may bring.
const PERMIT_PATIENCE: Duration = Duration::from_secs(5);

/// Least time between two stops of a rising tip that somebody presses.
const STOP_OF_RISE_EVERY: Duration = Duration::from_secs(1);

/// Whether the tip rises, and when somebody last stopped it: in this rise, or while it did not rise.
#[derive(Debug, Default)]
pub(crate) struct WayUp {
    is_under_way: bool,
    stopped: Option<MonoTime>,
}

/// What went wrong in one retract.
#[derive(Debug)]
struct Setbacks {
    /// Since the tip last rose.
    troubles: u32,
    stops: u32,
    /// Greatest height after a try.
    highest_mm: f64,
}

/// The tip rises as long as this lives.
struct Rising<'a>(&'a Shared);

impl WayUp {
    /// A stop from before the rise is forgotten: it may be one of another run, and stopped another motion.
    fn begin(&mut self) {
        *self = Self { is_under_way: true, stopped: None };
    }

    /// True if somebody's stop is carried out now. A rising tip gets up although stops never cease: it takes one a second.
    /// The supervisor's stops do not count, so that nobody's stop is without effect because of one.
    pub(crate) fn takes_stop(&mut self, now: MonoTime) -> bool {
        let is_early = self.stopped.is_some_and(|stopped| now.since(stopped) < STOP_OF_RISE_EVERY);
        let takes = !(self.is_under_way && is_early);
        if takes {
            self.stopped = Some(now);
        }
        takes
    }
}

impl Setbacks {
    fn new(z_mm: f64) -> Self {
        Self { troubles: 0, stops: 0, highest_mm: z_mm }
    }

    /// Counts what ended a try at this height.
    fn count(&mut self, error: &Broken, z_mm: f64, tolerance_mm: f64) {
        if z_mm > self.highest_mm + tolerance_mm {
            (self.troubles, self.highest_mm) = (0, z_mm);
        }
        if matches!(error, Broken::Stage(StageError::Stopped { .. } | StageError::Void(_))) {
            self.stops += 1;
        } else {
            self.troubles += 1;
        }
    }
}

impl<'a> Rising<'a> {
    fn begin(shared: &'a Shared) -> Self {
        shared.way_up().begin();
        Self(shared)
    }
}

impl Drop for Rising<'_> {
    fn drop(&mut self) {
        self.0.way_up().is_under_way = false;
    }
}

impl Shared {
    /// The confirmed position, robot frame.
    pub(crate) fn position_mm(&self) -> [f64; 3] {
        let state = self.stage.state();
        let report = state.borrow();
        [report.x_mm, report.y_mm, report.z_mm]
    }

    /// Travels to a place and a height, robot frame: up to the safe height first if it goes sideways.
    pub(crate) async fn travel(&self, to_mm: [f64; 2], z_mm: f64, speed_mm_per_s: f64) -> Result<(), Broken> {
        let [x_mm, y_mm, from_z_mm] = self.position_mm();
        let tolerance_mm = self.service.motion.tolerance_mm;
        let sideways_mm = (to_mm[0] - x_mm).hypot(to_mm[1] - y_mm);
        if sideways_mm > tolerance_mm {
            let over_mm = from_z_mm.max(z_mm).max(self.service.motion.safe_height_mm);
            if over_mm - from_z_mm > SAME_HEIGHT_MM {
                self.go([x_mm, y_mm, over_mm], speed_mm_per_s).await?;
            }
            self.go([to_mm[0], to_mm[1], over_mm], speed_mm_per_s).await?;
        }
        self.descend(to_mm, z_mm, speed_mm_per_s).await
    }

    /// Slides sideways at the height where it is, robot frame.
    pub(crate) async fn slide(&self, to_mm: [f64; 2], speed_mm_per_s: f64) -> Result<(), Broken> {
        let z_mm = self.position_mm()[2];
        self.go([to_mm[0], to_mm[1], z_mm], speed_mm_per_s).await.map(drop)
    }

    /// Goes to a height at one place, up or down: down to the safe height in one move, from there no faster than a load, and
    /// near the covering in small confirmed steps.
    pub(crate) async fn descend(
        &self,
        at_mm: [f64; 2],
        to_z_mm: f64,
        speed_mm_per_s: f64,
    ) -> Result<(), Broken> {
        let motion = &self.service.motion;
        let down_mm_per_s = speed_mm_per_s.min(self.service.envelope.load_speed_max_mm_per_s);
        let mut z_mm = self.position_mm()[2];
        for (stop_mm, speed_mm_per_s) in
            [(motion.safe_height_mm, speed_mm_per_s), (motion.approach_height_mm, down_mm_per_s)]
        {
            if z_mm > stop_mm + SAME_HEIGHT_MM && to_z_mm < z_mm {
                z_mm = self.go([at_mm[0], at_mm[1], to_z_mm.max(stop_mm)], speed_mm_per_s).await?[2];
            }
        }
        while (z_mm - to_z_mm).abs() > SAME_HEIGHT_MM {
            let (next_mm, speed_mm_per_s) = if to_z_mm < z_mm {
                (z_mm - confirmed_step_mm(z_mm - to_z_mm), down_mm_per_s)
            } else {
                (to_z_mm, speed_mm_per_s)
            };
            let reached_mm = self.go([at_mm[0], at_mm[1], next_mm], speed_mm_per_s).await?[2];
            if next_mm <= to_z_mm + SAME_HEIGHT_MM {
                return Ok(());
            }
            z_mm = reached_mm;
        }
        Ok(())
    }

    /// Moves straight up to the safe height, also after a stop: the stop halts the tip, and once the stage stands still
    /// the tip is raised, so that it does not stay pressed in. What goes wrong is tried again a few times.
    ///
    /// Returns the height reached, or why the tip could not be retracted.
    pub(crate) async fn retract(&self) -> Result<f64, Broken> {
        let mut setbacks = Setbacks::new(self.position_mm()[2]);
        let _rising = Rising::begin(self);
        loop {
            self.stand_still().await;
            let error = match self.rise().await {
                Ok([_, _, z_mm]) => return Ok(z_mm),
                Err(error) => error,
            };
            // An acquisition task that does not answer may only be slow.
            let is_gone = matches!(error, Broken::Gone(_)) && self.acquisition.is_closed();
            let is_lost = matches!(
                error,
                Broken::Denied(Denied::Fault(_))
                    | Broken::Stage(StageError::Unhomed | StageError::Alarm { .. })
            );
            if is_gone || is_lost {
                return Err(error);
            }
            if matches!(error, Broken::Denied(Denied::NoStage) | Broken::Stage(StageError::Device(_))) {
                self.stage_returns().await;
            }
            let z_mm = self.position_mm()[2];
            setbacks.count(&error, z_mm, self.service.motion.tolerance_mm);
            let Setbacks { troubles, stops, .. } = setbacks;
            if troubles > TROUBLES_MAX || stops > STOPS_MAX {
                return Err(error);
            }
            tracing::warn!(%error, z_mm, troubles, stops, "the tip is not up yet: trying again");
        }
    }

    /// One try to reach the safe height.
    async fn rise(&self) -> Result<[f64; 3], Broken> {
        let motion = &self.service.motion;
        let [x_mm, y_mm, z_mm] = self.position_mm();
        if z_mm >= motion.safe_height_mm - motion.tolerance_mm && self.status() == StageStatus::Idle {
            // The stage is asked: the position may be an old one.
            let reached_mm = self.stage.look().await?;
            if reached_mm[2] >= motion.safe_height_mm - motion.tolerance_mm {
                return Ok(reached_mm);
            }
        }
        let up = Target {
            position_mm: [x_mm, y_mm, motion.safe_height_mm.max(z_mm)],
            speed_mm_per_s: motion.travel_speed_mm_per_s,
        };
        let permit = self.permit(up).await?;
        Ok(self.stage.move_to(permit).await?)
    }

    /// Homes the stage. If a stop ends it, the error is the reason of the stop. After a silence of the sensor, or of the
    /// computer, it is homed anew.
    pub(crate) async fn home(&self) -> Result<(), Broken> {
        let mut tries = 0;
        loop {
            tries += 1;
            let error = match self.home_once().await {
                Ok(()) => return Ok(()),
                Err(error) => error,
            };
            let is_silence = matches!(&error, Broken::Ended(ending) if ending.is_silence())
                || matches!(
                    error,
                    Broken::Denied(_) | Broken::Stage(StageError::Unwatched { .. } | StageError::Void(_))
                );
            if !is_silence || tries == HOMINGS_MAX {
                return Err(error);
            }
            tracing::warn!(%error, "homing was broken off: it begins anew");
            self.stand_still().await;
            if self.status() == StageStatus::Alarm {
                // A homing that is stopped leaves some controllers in alarm.
                self.stage.clear_alarm().await?;
            }
            self.await_the_sensors_return().await?;
        }
    }

    async fn home_once(&self) -> Result<(), Broken> {
        self.check_ended()?;
        let now = self.clock.now().mono;
        let permit = self.acquisition.ask(move |live| live.supervisor.permit_homing(now)).await??;
        let homed = self.stage.home(permit).await;
        self.check_ended()?;
        Ok(homed?)
    }

    /// Makes one straight move. If a stop ends it, the error is the reason of the stop.
    async fn go(&self, position_mm: [f64; 3], speed_mm_per_s: f64) -> Result<[f64; 3], Broken> {
        let to = Target { position_mm, speed_mm_per_s };
        let deadline = self.clock.now().mono.after(PERMIT_PATIENCE);
        let mut tries = 0;
        loop {
            self.check_ended()?;
            tries += 1;
            let permit = self.unless_ended(self.permit(to)).await??;
            let moved = self.stage.move_to(permit).await;
            self.check_ended()?;
            match moved {
                // Nothing was sent. With a fast sensor and a slow computer permits are often too old.
                Err(StageError::Void(Void::Expired)) if self.clock.now().mono < deadline => {}
                Err(StageError::Unwatched { .. } | StageError::Unanswered { .. })
                    if tries < UNWATCHED_MAX =>
                {
                    tracing::warn!(tries, "a move was broken off: it goes on with a new permit");
                }
                moved => return Ok(moved?),
            }
        }
    }

    /// Leave to make one move. Waits a while if the next frame or report may bring it.
    async fn permit(&self, to: Target) -> Result<Permit, Broken> {
        let deadline = self.clock.now().mono.after(PERMIT_PATIENCE);
        loop {
            let now = self.clock.now().mono;
            match self.acquisition.ask(move |live| live.supervisor.permit(to, now)).await? {
                Err(denied) if denied.may_pass() && now < deadline => sleep(self.sample_period()).await,
                permit => return Ok(permit?),
            }
        }
    }

    /// Checks that the stage stands idle within tolerance of a place: it is asked, and its answer is younger than the
    /// question. Returns the epoch of its position.
    pub(crate) async fn stands_at(&self, target_mm: [f64; 3]) -> Result<u32, Broken> {
        let position_mm = self.stage.look().await?;
        let away_mm = position_mm.iter().zip(target_mm).map(|(at, to)| (at - to).powi(2)).sum::<f64>().sqrt();
        if away_mm > self.service.motion.tolerance_mm {
            return Err(StageError::NotThere { target_mm, position_mm }.into());
        }
        Ok(self.stage.state().borrow().epoch)
    }

    /// Retracts the tip. If that fails, it is a fault until the next reset, and told loudly.
    pub(crate) async fn retract_or_latch(&self) -> Result<f64, Broken> {
        let retracted = self.retract().await;
        if let Err(broken) = &retracted {
            self.latch_not_retracted(broken.to_string()).await;
        }
        retracted
    }

    /// Waits until the stage answers again, as long as the rig's policy allows.
    async fn stage_returns(&self) {
        let patience = Duration::from_millis(self.service.policy.reconnect_ms.into());
        let mut state = self.stage.state();
        let returned = state.wait_for(|report| report.status() != StageStatus::Disconnected);
        if timeout(patience, returned).await.is_err() {
            tracing::warn!("the stage did not come back within {patience:?}");
        }
    }

    /// Waits until a stopped stage stands still. A stage that stays in a hold is stopped again, which frees it. If it does not
    /// come to stand, the next command fails.
    pub(crate) async fn stand_still(&self) {
        if self.stands_in_time().await {
            return;
        }
        if self.status() == StageStatus::Hold {
            tracing::warn!("the stage stays in a hold: it is stopped again");
            self.stage.stop();
            if self.stands_in_time().await {
                return;
            }
        }
        tracing::warn!("the stage did not come to a standstill within {STANDSTILL:?}");
    }

    /// True once the stage neither moves nor is in a hold, if that comes in time.
    async fn stands_in_time(&self) -> bool {
        let mut state = self.stage.state();
        let standing = state.wait_for(|report| {
            !matches!(report.status(), StageStatus::Moving | StageStatus::Hold | StageStatus::Homing)
        });
        timeout(STANDSTILL, standing).await.is_ok()
    }
}

/// Length of one step when a descent is divided into the fewest equal steps. Equal steps avoid a last step so short that
/// the stage hardly accelerates.
fn confirmed_step_mm(way_mm: f64) -> f64 {
    // Rounding must not add a step to a whole number of steps.
    way_mm / (way_mm / STEP_DOWN_MAX_MM - 1e-6).ceil().max(1.0)
}

#[cfg(test)]
#[path = "motion_tests.rs"]
mod tests;
