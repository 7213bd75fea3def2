//! Publishes a rig's health once a second.

use std::time::Duration;

use tactus_bus::Publisher;
use tactus_engine::Engine;
use tactus_schema::{MonoTime, TimeStamp, pb};
use tokio::time::interval;

use super::commands::CommandDesk;

pub(super) const PERIOD: Duration = Duration::from_secs(1);

/// Publishes until it is dropped.
pub(super) async fn publish(desk: &CommandDesk, publisher: &Publisher) {
    let mut tick = interval(PERIOD);
    let mut before = (0, desk.engine().clock().now().mono);
    loop {
        tick.tick().await;
        let health = desk.health(before);
        before = (health.frames, MonoTime::from_ns(health.t_mono_ns));
        publisher.publish(&health);
    }
}

/// The health of a rig that is not up.
pub(super) fn of_missing(problem: &str, now: TimeStamp) -> pb::Health {
    pb::Health {
        t_mono_ns: now.mono.ns(),
        t_wall_ns: now.wall.ns(),
        version: env!("CARGO_PKG_VERSION").into(),
        problem: problem.to_owned(),
        ..Default::default()
    }
}

/// The present health. The frame rate is over the time since `before`.
pub(super) fn health(
    engine: &Engine,
    publisher: &Publisher,
    before: (u64, MonoTime),
    lease_holder: String,
) -> pb::Health {
    let now = engine.clock().now();
    let pulse = *engine.pulse().borrow();
    let (frames_before, at_before) = before;
    let seconds = now.mono.since(at_before).as_secs_f64();
    let stage = engine.stage_state().status();
    let stage_connected = !matches!(stage, pb::StageStatus::Unspecified | pb::StageStatus::Disconnected);
    pb::Health {
        t_mono_ns: now.mono.ns(),
        t_wall_ns: now.wall.ns(),
        version: env!("CARGO_PKG_VERSION").into(),
        uptime_s: now.mono.seconds(),
        sensor_connected: pulse.sensor_connected,
        stage_connected,
        frames: pulse.frames,
        frames_lost: pulse.frames_lost,
        frames_dropped_on_bus: publisher.dropped_frames(),
        frame_rate_hz: if seconds > 0.0 { (pulse.frames - frames_before) as f64 / seconds } else { 0.0 },
        clock_offset_s: pulse.clock_offset_s.map(|[least_s, _]| least_s),
        clock_uncertainty_s: pulse.clock_offset_s.map(|[least_s, greatest_s]| greatest_s - least_s),
        simulated: engine.rig().simulated,
        lease_holder,
        problem: problem(pulse.sensor_connected, stage_connected).into(),
    }
}

fn problem(sensor_connected: bool, stage_connected: bool) -> &'static str {
    match (sensor_connected, stage_connected) {
        (true, true) => "",
        (false, true) => "the sensor does not answer",
        (true, false) => "the stage does not answer",
        (false, false) => "sensor and stage do not answer",
    }
}
