//! Converts a rig's axes to the configuration of a `zaber-ascii` session.

use tactus_schema::rig::{ZaberAxes, ZaberAxis};
use tactus_wire::zaber::{Axis, Config};

use super::direction;

pub(super) fn config(zaber: &ZaberAxes, tolerance_mm: f64) -> Config {
    let ZaberAxes { axes, accel_mm_per_s2, homing_speed_mm_per_s, checksums, trusts_reference } = *zaber;
    Config {
        axes: axes.map(|one| one.map(axis)),
        tolerance_mm,
        accel_mm_per_s2,
        homing_speed_mm_per_s,
        checksums,
        trusts_reference,
    }
}

fn axis(one: ZaberAxis) -> Axis {
    let ZaberAxis { device, axis, um_per_microstep, is_forward, origin_microsteps, resolution } = one;
    let direction = direction(is_forward);
    Axis { device, number: axis, um_per_microstep, direction, origin_microsteps, resolution }
}
