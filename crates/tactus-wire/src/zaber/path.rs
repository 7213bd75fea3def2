//! Splits a straight path into moves of the axes that end at the same time.

use super::Axis;

/// `maxspeed` in microsteps per second.
const SPEED_SCALE: f64 = 1.6384;

/// `accel` in microsteps per second squared.
const ACCEL_SCALE: f64 = 1.6384 / 10_000.0;

/// Largest value of either setting.
const SETTING_MAX: f64 = 2_147_483_647.0;

/// The setting `maxspeed` for a speed, rounded, at least 1. `None` if the speed is not more than 0 or exceeds 32 bits.
///
/// # Source
/// The manual's entry of `maxspeed`: speed in microsteps/s times 1.6384.
pub fn speed_setting(microsteps_per_s: f64) -> Option<i64> {
    setting(microsteps_per_s * SPEED_SCALE)
}

/// The setting `accel` for an acceleration, rounded, at least 1 because 0 means no limit. `None` if the acceleration is not
/// more than 0 or exceeds 32 bits.
///
/// # Source
/// The manual's entry of `accel`: acceleration in microsteps/s² times 1.6384 / 10000.
pub fn accel_setting(microsteps_per_s2: f64) -> Option<i64> {
    setting(microsteps_per_s2 * ACCEL_SCALE)
}

/// The speed in microsteps/s of a setting `maxspeed`.
pub fn speed_told(setting: i64) -> f64 {
    setting as f64 / SPEED_SCALE
}

/// The acceleration in microsteps/s^2 of a setting `accel`.
pub fn accel_told(setting: i64) -> f64 {
    setting as f64 / ACCEL_SCALE
}

/// The part of a move that one axis makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct AxisMove {
    pub(super) target_microsteps: i64,
    pub(super) speed: i64,
    pub(super) accel: Option<i64>,
}

/// The move of an axis that travels `way_mm` (of either sign) on a path of `path_mm`. `None` if speed or acceleration is
/// outside the controller's range.
pub(super) fn axis_move(
    axis: &Axis,
    target_microsteps: i64,
    way_mm: f64,
    path_mm: f64,
    speed_mm_per_s: f64,
    accel_mm_per_s2: Option<f64>,
) -> Option<AxisMove> {
    let share = (way_mm / path_mm).abs().min(1.0);
    let microsteps = |mm: f64| mm * 1000.0 / axis.um_per_microstep;
    let speed = microsteps(speed_mm_per_s * share);
    // Rounding up to 1 must not make the axis that travels farthest faster than requested. Its share is at least 0.57.
    if share > 0.5 && speed * SPEED_SCALE < 1.0 {
        return None;
    }
    let accel = match accel_mm_per_s2 {
        Some(accel) => Some(accel_setting(microsteps(accel * share))?),
        None => None,
    };
    Some(AxisMove { target_microsteps, speed: speed_setting(speed)?, accel })
}

#[expect(clippy::cast_possible_truncation, reason = "checked to be within 32 bits")]
fn setting(value: f64) -> Option<i64> {
    (value > 0.0 && value <= SETTING_MAX).then(|| value.round().max(1.0) as i64)
}

#[cfg(test)]
#[path = "path_tests.rs"]
mod tests;
