//! Motion of the tip: first up, then sideways, last down in small confirmed steps.

use std::time::Duration;

use tactus_device::{StageError, Target};
use tactus_schema::pb::StageStatus;
use tokio::time::timeout;

use crate::engine::Shared;
use crate::run::Broken;

/// Longest downward step near the covering. The next step is commanded only after the last is confirmed, so that a host
/// that dies leaves the tip at most this far below its last confirmed height.
const UNCONFIRMED_MAX_MM: f64 = 0.1;

/// Heights that differ by less count as equal: a third of the stage's vertical step.
const SAME_HEIGHT_MM: f64 = 0.0003;

/// Longest time that a stopped stage may take to stand still.
const STANDSTILL: Duration = Duration::from_secs(5);

/// Greatest number of refused retract commands before the run gives up.
const REFUSALS_MAX: u32 = 5;

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

    /// Goes to a height at one place, up or down; near the covering in small confirmed steps.
    pub(crate) async fn descend(
        &self,
        at_mm: [f64; 2],
        to_z_mm: f64,
        speed_mm_per_s: f64,
    ) -> Result<(), Broken> {
        let near_mm = self.service.motion.approach_height_mm;
        let mut z_mm = self.position_mm()[2];
        if z_mm > near_mm + SAME_HEIGHT_MM && to_z_mm < z_mm {
            z_mm = self.go([at_mm[0], at_mm[1], to_z_mm.max(near_mm)], speed_mm_per_s).await?[2];
        }
        while (z_mm - to_z_mm).abs() > SAME_HEIGHT_MM {
            let next_mm = if to_z_mm < z_mm { z_mm - confirmed_step_mm(z_mm - to_z_mm) } else { to_z_mm };
            let down_max_mm_per_s = self.service.envelope.load_speed_max_mm_per_s;
            let speed_mm_per_s =
                if next_mm < z_mm { speed_mm_per_s.min(down_max_mm_per_s) } else { speed_mm_per_s };
            let reached_mm = self.go([at_mm[0], at_mm[1], next_mm], speed_mm_per_s).await?[2];
            if next_mm <= to_z_mm + SAME_HEIGHT_MM {
                return Ok(());
            }
            z_mm = reached_mm;
        }
        Ok(())
    }

    /// Moves straight up to the safe height, also after a stop: the stop halts the tip, and once the stage stands still
    /// the tip is raised, so that it does not stay pressed in.
    ///
    /// Returns the height reached, or why the tip could not be retracted.
    pub(crate) async fn retract(&self) -> Result<f64, StageError> {
        let motion = &self.service.motion;
        let mut refusals = 0;
        loop {
            self.stand_still().await;
            let [x_mm, y_mm, z_mm] = self.position_mm();
            let reached = if z_mm >= motion.safe_height_mm - motion.tolerance_mm && self.is_idle() {
                Ok([x_mm, y_mm, z_mm])
            } else {
                let up = Target {
                    position_mm: [x_mm, y_mm, motion.safe_height_mm.max(z_mm)],
                    speed_mm_per_s: motion.travel_speed_mm_per_s,
                };
                self.stage.move_to(up).await
            };
            match reached {
                Ok([_, _, z_mm]) => return Ok(z_mm),
                Err(StageError::Stopped { .. }) => {}
                Err(StageError::Refused { .. }) if refusals < REFUSALS_MAX => refusals += 1,
                Err(error) => return Err(error),
            }
        }
    }

    /// Makes one straight move. If a stop ends it, the error is the reason of the stop.
    async fn go(&self, position_mm: [f64; 3], speed_mm_per_s: f64) -> Result<[f64; 3], Broken> {
        // Make the order before the check, so that a stop between the two counts as later than the order.
        let order = self.stage.move_to(Target { position_mm, speed_mm_per_s });
        self.check_ended()?;
        let moved = order.await;
        self.check_ended()?;
        Ok(moved?)
    }

    fn is_idle(&self) -> bool {
        self.stage.state().borrow().status() == StageStatus::Idle
    }

    /// Waits until a stopped stage stands still. If it does not, the next command fails.
    async fn stand_still(&self) {
        let mut state = self.stage.state();
        let standing = state.wait_for(|report| {
            !matches!(report.status(), StageStatus::Moving | StageStatus::Hold | StageStatus::Homing)
        });
        if timeout(STANDSTILL, standing).await.is_err() {
            tracing::warn!("the stage did not come to a stand within {STANDSTILL:?}");
        }
    }
}

/// Length of one step when a descent is divided into the fewest equal steps. Equal steps avoid a last step so short that
/// the stage hardly accelerates.
fn confirmed_step_mm(way_mm: f64) -> f64 {
    // Rounding must not add a step to a whole number of steps.
    way_mm / (way_mm / UNCONFIRMED_MAX_MM - 1e-6).ceil().max(1.0)
}
