//! The configuration of a stage: its axes and limits.

use super::speed_setting;
use crate::stage::{AxisName, Direction};

/// Largest magnitude of a position that fits in the controller's 32 bits.
const POSITION_MAX_MICROSTEPS: f64 = 2_147_483_647.0;

/// A stage: up to three axes of one or more devices on one port.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// x, y and z. A missing axis always stands at 0 mm.
    pub axes: [Option<Axis>; 3],
    /// A move is done when the stage stands within this distance of the target; more than 0.
    pub tolerance_mm: f64,
    /// Acceleration along the path, more than 0. Each axis is set to its component. `None` keeps the axes' settings.
    pub accel_mm_per_s2: Option<f64>,
    /// Speed of each axis for homing (`maxspeed`), more than 0. `None` keeps the speed of the last move, which may be much
    /// lower. The axes limit their speed near the home sensor by themselves.
    pub homing_speed_mm_per_s: Option<f64>,
    /// Send checksums, and set the devices to send them (`comm.checksum`). Messages without one are then dropped.
    pub checksums: bool,
    /// If true, a stage that reports a reference position when it is connected counts as homed. If false, it must be homed
    /// after each connection. (An axis that stalled reports a reference, too, once someone else has cleared its warning.)
    pub trusts_reference: bool,
}

/// An axis of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Address of the device, 1 to 99.
    pub device: u8,
    /// Number of the axis in the device, 1 to 9.
    pub number: u8,
    /// Length of a microstep, more than 0.
    pub um_per_microstep: f64,
    /// Direction in which it counts.
    pub direction: Direction,
    /// Controller's position at the stage's 0 mm.
    pub origin_microsteps: i32,
    /// Required `resolution` in microsteps per full step, more than 0: the length of a microstep depends on it. `None`
    /// accepts any.
    pub resolution: Option<u32>,
}

/// Why a configuration is invalid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ConfigError {
    /// It has no axis.
    #[error("the stage has no axis")]
    NoAxis,
    /// A number is out of range.
    #[error("{name}: {field} is {value}, but must be {range}")]
    Range { name: AxisName, field: &'static str, value: f64, range: &'static str },
    /// A number is not positive.
    #[error("{field} is {value}, but must be more than 0")]
    NotPositive { field: &'static str, value: f64 },
    /// Two axes of the stage use the same axis of a device.
    #[error("{first} and {second} are the same axis of the same device")]
    Same { first: AxisName, second: AxisName },
}

impl Config {
    /// Checks the numbers.
    ///
    /// # Errors
    /// If it has no axis, one axis twice, or a number that is out of range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let positive = |field, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(ConfigError::NotPositive { field, value })
            }
        };
        positive("tolerance_mm", self.tolerance_mm)?;
        if let Some(accel_mm_per_s2) = self.accel_mm_per_s2 {
            positive("accel_mm_per_s2", accel_mm_per_s2)?;
        }
        if let Some(speed_mm_per_s) = self.homing_speed_mm_per_s {
            positive("homing_speed_mm_per_s", speed_mm_per_s)?;
        }
        let mut seen: Vec<(AxisName, Axis)> = Vec::new();
        for (name, axis) in self.named_axes() {
            axis.check(name)?;
            let same =
                seen.iter().find(|(_, other)| (other.device, other.number) == (axis.device, axis.number));
            if let Some((first, _)) = same {
                return Err(ConfigError::Same { first: *first, second: name });
            }
            seen.push((name, axis));
        }
        if seen.is_empty() { Err(ConfigError::NoAxis) } else { Ok(()) }
    }

    /// The axes that are present, by name.
    pub(super) fn named_axes(&self) -> impl Iterator<Item = (AxisName, Axis)> {
        AxisName::ALL.into_iter().zip(self.axes).filter_map(|(name, axis)| Some((name, axis?)))
    }
}

impl Axis {
    /// Converts the controller's position to the stage's frame.
    #[expect(clippy::cast_precision_loss, reason = "exact up to 2^53 microsteps, which are kilometres")]
    pub fn position_mm(&self, microsteps: i64) -> f64 {
        let from_origin = microsteps.saturating_sub(i64::from(self.origin_microsteps));
        self.direction.sign() * from_origin as f64 * self.um_per_microstep / 1000.0 + 0.0
    }

    /// The nearest position of the controller; `None` if it exceeds 32 bits.
    #[expect(clippy::cast_possible_truncation, reason = "checked to be within 32 bits")]
    pub fn microsteps(&self, position_mm: f64) -> Option<i64> {
        let from_origin = self.direction.sign() * position_mm * 1000.0 / self.um_per_microstep;
        let microsteps = (from_origin + f64::from(self.origin_microsteps)).round();
        (microsteps.abs() <= POSITION_MAX_MICROSTEPS).then_some(microsteps as i64)
    }

    /// The setting `maxspeed` for a speed; `None` if the speed is not more than 0 or exceeds 32 bits.
    pub fn speed_setting(&self, speed_mm_per_s: f64) -> Option<i64> {
        speed_setting(speed_mm_per_s * 1000.0 / self.um_per_microstep)
    }

    fn check(&self, name: AxisName) -> Result<(), ConfigError> {
        let range = |field, value, range| Err(ConfigError::Range { name, field, value, range });
        if !(1..=99).contains(&self.device) {
            return range("device", f64::from(self.device), "1 to 99");
        }
        if !(1..=9).contains(&self.number) {
            return range("number", f64::from(self.number), "1 to 9");
        }
        let um = self.um_per_microstep;
        if !(um.is_finite() && um > 0.0) {
            return range("um_per_microstep", um, "more than 0");
        }
        if self.resolution == Some(0) {
            return range("resolution", 0.0, "more than 0");
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "config_tests.rs"]
mod tests;
