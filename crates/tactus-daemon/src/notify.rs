//! What systemd is told: ready, alive, stopping. Nothing happens where there is no systemd.

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

/// Feeds the watchdog for as long as acquisition and the safety supervisor really go on.
pub(crate) async fn feed_watchdog(engine: Engine) {
    let Some(limit) = sd_notify::watchdog_enabled() else { return };
    let pulse = engine.pulse();
    let mut fed = Pulse::default();
    // Half the limit, as sd_watchdog_enabled(3) advises; nothing can have gone on before the first half is over.
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
        warn!(%error, "systemd could not be told");
    }
}
