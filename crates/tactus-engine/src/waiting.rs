//! Waiting: for the sensor, for the stage, and no longer than until the run is asked to end.

use std::time::Duration;

use tactus_schema::pb;
use tokio::time::timeout;

use crate::engine::Shared;
use crate::run::Broken;

impl Shared {
    /// Withdraws a silence as the reason to end once frames arrive again, and has the supervisor check again.
    pub(crate) async fn await_the_sensors_return(&self) -> Result<(), Broken> {
        self.control.send_modify(|control| {
            control.ending.take_if(|ending| ending.is_silence());
        });
        self.wait_for_sensor().await?;
        let now = self.clock.now().mono;
        Ok(self.acquisition.ask(move |live| live.supervisor.forgive_silence(now)).await?)
    }

    /// Waits until frames arrive, as long as the rig's policy allows.
    pub(crate) async fn wait_for_sensor(&self) -> Result<(), Broken> {
        let patience = Duration::from_millis(self.service.policy.reconnect_ms.into());
        let since = self.clock.now().mono;
        let mut pulse = self.pulse.subscribe();
        let flowing = pulse.wait_for(|pulse| pulse.sensor_connected && pulse.last_frame > since);
        match self.unless_ended(timeout(patience, flowing)).await? {
            Ok(_) => Ok(()),
            Err(_) => Err(Broken::SensorSilent(patience.as_secs_f64())),
        }
    }

    /// Waits until the stage answers, as long as the rig's policy allows. Other problems show at the first move.
    pub(crate) async fn wait_for_stage(&self) -> Result<(), Broken> {
        let patience = Duration::from_millis(self.service.policy.reconnect_ms.into());
        let mut state = self.stage.state();
        let answering = state.wait_for(|report| {
            !matches!(report.status(), pb::StageStatus::Unspecified | pb::StageStatus::Disconnected)
        });
        if self.unless_ended(timeout(patience, answering)).await?.is_ok() {
            return Ok(());
        }
        // A driver without a stage says at once why it has none.
        match self.unless_ended(self.stage.look()).await? {
            Ok(_) => Ok(()),
            Err(error) => Err(Broken::StageSilent(patience.as_secs_f64(), error)),
        }
    }

    /// An error if the run was asked to end.
    pub(crate) fn check_ended(&self) -> Result<(), Broken> {
        self.control.borrow().ending.clone().map_or(Ok(()), |ending| Err(Broken::Ended(ending)))
    }

    /// The result of `future`, unless the run is asked to end first.
    pub(crate) async fn unless_ended<T>(&self, future: impl Future<Output = T>) -> Result<T, Broken> {
        let mut control = self.control.subscribe();
        tokio::select! {
            biased;
            // Waiting cannot fail because the sender lives in `self`; otherwise the future decides.
            Ok(control) = control.wait_for(|control| control.ending.is_some()) => {
                let ending = control.ending.clone();
                drop(control);
                match ending {
                    Some(ending) => Err(Broken::Ended(ending)),
                    None => unreachable!("waited for an ending"),
                }
            }
            value = future => Ok(value),
        }
    }
}
