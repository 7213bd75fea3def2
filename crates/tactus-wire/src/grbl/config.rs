//! What is asked of a controller, and how its axes lie in the stage's frame.

use crate::stage::{AxisName, Direction};

/// What is asked of the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// A move is done when the controller stands within this of the target, more than 0.
    pub tolerance_mm: f64,
    /// Which axes of the controller serve x, y and z.
    pub axes: [Axis; 3],
    /// The controller must have its soft limits on (`$20`), so that it refuses what is beyond its travel.
    pub needs_soft_limits: bool,
}

/// One axis of the stage, as the controller has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The controller's axis.
    pub machine: AxisName,
    /// Which way it counts.
    pub direction: Direction,
    /// The controller's coordinate that is 0 mm.
    pub origin_mm: f64,
    /// What the controller must have as its steps per mm (`$100` to `$102`), more than 0; `None` takes any.
    pub steps_per_mm: Option<f64>,
}

/// Why a configuration makes no stage.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum ConfigError {
    /// A number of the stage is not more than 0.
    #[error("{field} is {value}, but must be more than 0")]
    NotPositive { field: &'static str, value: f64 },
    /// An origin is no place.
    #[error("{name}: origin_mm is {value}, but must be a number")]
    Origin { name: AxisName, value: f64 },
    /// An axis of the controller would serve two of the stage.
    #[error("{first} and {second} are the same axis of the controller")]
    Same { first: AxisName, second: AxisName },
}

impl Config {
    /// A controller whose axes lie as the stage's: the same names, directions and origin.
    pub fn aligned(tolerance_mm: f64) -> Self {
        let axes = AxisName::ALL.map(|machine| Axis {
            machine,
            direction: Direction::Positive,
            origin_mm: 0.0,
            steps_per_mm: None,
        });
        Self { tolerance_mm, axes, needs_soft_limits: true }
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// If a number is out of range, or one axis of the controller serves two of the stage.
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

    /// Where a place of the controller is in the stage's frame.
    pub fn to_stage(&self, machine_mm: [f64; 3]) -> [f64; 3] {
        // No negative zero.
        self.axes.map(|axis| axis.direction.sign() * (axis.machine.of(machine_mm) - axis.origin_mm) + 0.0)
    }

    /// Where a place of the stage is in the controller's coordinates.
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
