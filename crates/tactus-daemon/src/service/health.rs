//! Publishes the service's health once a second.

use std::time::Duration;

use tactus_bus::Publisher;
use tactus_engine::Engine;
use tactus_schema::{MonoTime, pb};
use tokio::time::interval;

const PERIOD: Duration = Duration::from_secs(1);

/// `holder` tells who holds the lease.
pub(super) async fn publish(engine: Engine, publisher: Publisher, holder: impl Fn() -> String + Send) {
    let mut tick = interval(PERIOD);
    let mut before = (0, engine.clock().now().mono);
    loop {
        tick.tick().await;
        let health = health(&engine, &publisher, before, holder());
        before = (health.frames, MonoTime::from_ns(health.t_mono_ns));
        publisher.publish(&health);
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
    pb::Health {
        t_mono_ns: now.mono.ns(),
        t_wall_ns: now.wall.ns(),
        version: env!("CARGO_PKG_VERSION").into(),
        uptime_s: now.mono.seconds(),
        sensor_connected: pulse.sensor_connected,
        stage_connected: !matches!(stage, pb::StageStatus::Unspecified | pb::StageStatus::Disconnected),
        frames: pulse.frames,
        frames_lost: pulse.frames_lost,
        frames_dropped_on_bus: publisher.dropped_frames(),
        frame_rate_hz: if seconds > 0.0 { (pulse.frames - frames_before) as f64 / seconds } else { 0.0 },
        clock_offset_s: pulse.clock_offset_s.map(|[least_s, _]| least_s),
        clock_uncertainty_s: pulse.clock_offset_s.map(|[least_s, greatest_s]| greatest_s - least_s),
        simulated: engine.rig().simulated,
        lease_holder,
    }
}
