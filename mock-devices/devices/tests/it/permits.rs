//! Permits for tests that move the stage alone.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::time::Duration;

use tactus_device::{HomingPermit, Permit, Target};
use tactus_safety::Supervisor;
use tactus_schema::pb::{StageState, StageStatus};
use tactus_schema::{MonoTime, Rig};

/// Leave to move anywhere: a supervisor that takes the stage to stand there already.
pub(crate) fn permit(target: Target) -> Permit {
    let [x_mm, y_mm, z_mm] = target.position_mm;
    let status = StageStatus::Idle.into();
    let mut supervisor = supervisor();
    // Some tests go deeper than the rig allows.
    let _too_deep = supervisor.on_report(&StageState { x_mm, y_mm, z_mm, status, ..Default::default() });
    supervisor.permit(target, MonoTime::default()).unwrap()
}

/// Leave to home, which does not expire in a test.
pub(crate) fn homing() -> HomingPermit {
    supervisor().permit_homing(MonoTime::default().after(Duration::from_secs(1_000_000))).unwrap()
}

fn supervisor() -> Supervisor {
    let rig = Rig::from_toml(include_str!("../../../../config/rigs/sim.toml")).unwrap();
    Supervisor::without_sensor(&rig, rig.service.as_ref().unwrap())
}
