//! A sensor's pose, or its difference from the declared one.

use serde::{Deserialize, Serialize};
use tactus_model::Registration;

use crate::description::{WrongField, finite};

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawRegistration {
    /// The sensor's origin in the robot's frame.
    origin_mm: [f64; 2],
    /// Rotation of the sensor in the robot's frame, counter-clockwise.
    rotation_deg: f64,
}

impl RawRegistration {
    pub(super) fn of(registration: &Registration) -> Self {
        let Registration { origin_mm, rotation_deg } = *registration;
        Self { origin_mm, rotation_deg }
    }

    pub(super) fn check(&self, field: &str) -> Result<Registration, WrongField> {
        let [x, y] = self.origin_mm;
        Ok(Registration {
            origin_mm: [
                finite(format!("{field}.origin_mm[0]"), x)?,
                finite(format!("{field}.origin_mm[1]"), y)?,
            ],
            rotation_deg: finite(format!("{field}.rotation_deg"), self.rotation_deg)?,
        })
    }
}
