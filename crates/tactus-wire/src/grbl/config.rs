//! Requirements on a controller, and the orientation of its axes in the stage's frame.

use crate::stage::{AxisName, Direction};

/// Requirements on the controller, and the orientation of its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// A move is done when the controller stands within this distance of the target; more than 0.
    pub tolerance_mm: f64,
    /// The controller's axes for the stage's x, y and z.
    pub axes: [Axis; 3],
    /// Require soft limits (`$20`), so that the controller refuses targets beyond its travel.
    pub needs_soft_limits: bool,
}

/// The controller's axis for one axis of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Its name in the controller.
    pub machine: AxisName,
    /// Direction in which it counts.
    pub direction: Direction,
    /// Coordinate of the controller at the stage's 0 mm.
    pub origin_mm: f64,
    /// Required steps per mm (`$100` to `$102`), more than 0; `None` accepts any.
    pub steps_per_mm: Option<f64>,
    /// End of the stage's axis that homing must go to (`$23`); `None` accepts either. z must home upwards: the other way
    /// is into the sensor.
    pub home: Option<Direction>,
}

/// Why a configuration is invalid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ConfigError {
    /// A number of the stage is not more than 0.
    #[error("{field} is {value}, but must be more than 0")]
    NotPositive { field: &'static str, value: f64 },
    /// An origin is not finite.
    #[error("{name}: origin_mm is {value}, but must be a number")]
    Origin { name: AxisName, value: f64 },
    /// Two axes of the stage use the same axis of the controller.
    #[error("{first} and {second} are the same axis of the controller")]
    Same { first: AxisName, second: AxisName },
}

impl Config {
    /// A controller with the stage's axes: the same names, directions and origin.
    pub fn aligned(tolerance_mm: f64) -> Self {
        let axes = AxisName::ALL.map(|machine| Axis {
            machine,
            direction: Direction::Positive,
            origin_mm: 0.0,
            steps_per_mm: None,
            home: (machine == AxisName::Z).then_some(Direction::Positive),
        });
        Self { tolerance_mm, axes, needs_soft_limits: true }
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// If a number is out of range, or two axes of the stage use the same axis of the controller.
    pub fn check(&self) -> Result<(), ConfigError> {
        let positive = |field, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(ConfigError::NotPositive { field, value })
            }
        };
        positive("tolerance_mm", self.tolerance_mm)?;
        for (name, axis) in self.named_axes() {
            positive("steps_per_mm", axis.steps_per_mm.unwrap_or(1.0))?;
            if !axis.origin_mm.is_finite() {
                return Err(ConfigError::Origin { name, value: axis.origin_mm });
            }
            let same = self.named_axes().take_while(|(first, _)| *first != name);
            if let Some((first, _)) = same.into_iter().find(|(_, other)| other.machine == axis.machine) {
                return Err(ConfigError::Same { first, second: name });
            }
        }
        Ok(())
    }

    /// Converts the controller's coordinates to the stage's frame.
    pub fn to_stage(&self, machine_mm: [f64; 3]) -> [f64; 3] {
        // No negative zero.
        self.axes.map(|axis| axis.direction.sign() * (axis.machine.of(machine_mm) - axis.origin_mm) + 0.0)
    }

    /// Converts a position in the stage's frame to the controller's coordinates.
    pub fn to_machine(&self, stage_mm: [f64; 3]) -> [f64; 3] {
        let mut machine_mm = [0.0; 3];
        for (name, axis) in self.named_axes() {
            let mm = axis.origin_mm + axis.direction.sign() * name.of(stage_mm);
            axis.machine.set(&mut machine_mm, mm + 0.0);
        }
        machine_mm
    }

    pub(super) fn named_axes(&self) -> impl Iterator<Item = (AxisName, Axis)> {
        AxisName::ALL.into_iter().zip(self.axes)
    }
}

#[cfg(test)]
#[path = "config_tests.rs"]
mod tests;
