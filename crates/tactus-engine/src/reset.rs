//! The reset: it ends a fault. The stage is homed, the tip raised, and frames must arrive.

use tactus_safety::Denied;
use tactus_schema::pb::StageStatus;
use tracing::info;

use crate::acquisition::Gone;
use crate::engine::{ResetError, Shared};
use crate::run::{Broken, Ending};

impl Shared {
    /// The steps of a reset that a client asks for: an alarm is cleared, and the stage is homed in any case.
    pub(crate) async fn reset(&self) -> Result<(), ResetError> {
        let not_ready = |why: Broken| ResetError::NotReady(why.to_string());
        self.begin_reset().await?;
        // A controller in a hold would refuse to home.
        self.stand_still().await;
        if self.status() == StageStatus::Idle {
            // A tip that is too deep, or under a sensor that is silent, breaks a rule at once: up first, which is always
            // permitted.
            self.retract_or_latch().await?;
            self.control.send_modify(|control| {
                control.ending.take_if(|ending| matches!(ending, Ending::Safety(_)));
            });
            self.begin_reset().await?;
        }
        self.wait_for_stage().await.map_err(not_ready)?;
        // If it was away, it is homed from here on.
        self.begin_reset().await?;
        self.wait_for_sensor().await.map_err(not_ready)?;
        if self.status() == StageStatus::Alarm {
            self.stage.clear_alarm().await?;
        }
        self.home().await?;
        self.retract_or_latch().await?;
        self.wait_for_sensor().await.map_err(not_ready)?;
        self.check_ended()?;
        self.finish_reset().await?.map_err(|denied| ResetError::NotReady(denied.to_string()))
    }

    /// What a run does that replaces a reset: it homes a stage that does not know where it is.
    pub(crate) async fn reset_for_run(&self) -> Result<(), Broken> {
        self.begin_reset().await?;
        self.stand_still().await;
        if self.status() == StageStatus::Unhomed {
            info!("homing the stage");
            self.home().await?;
        }
        self.retract_or_latch().await?;
        Ok(self.finish_reset().await??)
    }

    async fn begin_reset(&self) -> Result<(), Gone> {
        let now = self.clock.now().mono;
        self.acquisition.ask(move |live| live.supervisor.begin_reset(now)).await
    }

    async fn finish_reset(&self) -> Result<Result<(), Denied>, Gone> {
        let now = self.clock.now().mono;
        self.acquisition.ask(move |live| live.supervisor.finish_reset(now)).await
    }
}
