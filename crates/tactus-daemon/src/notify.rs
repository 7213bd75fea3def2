//! Notifications for systemd: ready, alive, stopping. Without systemd nothing happens.

use std::time::Duration;

use sd_notify::NotifyState;
use tactus_engine::{Engine, Pulse};
use tokio::time::{Instant, interval_at};
use tracing::{error, warn};

/// Frames flow: the service is ready.
pub(crate) fn ready(rig: &str) {
    tell(&[NotifyState::Ready, NotifyState::Status(&format!("rig {rig}: frames flow"))]);
}

/// The service is closing down.
pub(crate) fn stopping() {
    tell(&[NotifyState::Stopping]);
}

/// Feeds the watchdog while acquisition and the safety supervisor make progress.
pub(crate) async fn feed_watchdog(engine: Engine) {
    let Some(limit) = sd_notify::watchdog_enabled() else { return };
    let pulse = engine.pulse();
    let mut fed = Pulse::default();
    // Half the limit, as sd_watchdog_enabled(3) advises. The first check is after one period: before it there is no progress to see.
    let period = (limit / 2).max(Duration::from_millis(1));
    let mut tick = interval_at(Instant::now() + period, period);
    loop {
        tick.tick().await;
        let now = *pulse.borrow();
        if engine.is_acquiring() && now.supervised > fed.supervised {
            tell(&[NotifyState::Watchdog]);
            fed = now;
        } else {
            error!("acquisition does not go on: the watchdog is not fed");
        }
    }
}

fn tell(states: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(states) {
        warn!(%error, "systemd could not be notified");
    }
}
