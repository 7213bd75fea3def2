//! Why a session is over.

use crate::stage::{AxisName, Cause};
use crate::zaber::Rejection;

/// Why a session is over.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SessionError {
    /// A device never answered.
    #[error(
        "device {device} does not answer: does it speak Zaber's ASCII protocol, and is the bit rate right?"
    )]
    NoDevice {
        /// Its address.
        device: u8,
    },
    /// A device stopped answering.
    #[error("device {device} did not answer to {command:?}")]
    Silent {
        /// Its address.
        device: u8,
        /// What was asked.
        command: String,
    },
    /// A device refused a question without which nothing can be done.
    #[error("device {device} refused {command:?}: {rejection}")]
    Refused {
        /// Its address.
        device: u8,
        /// What was asked.
        command: String,
        /// Why.
        rejection: Rejection,
    },
    /// A device has fewer axes than are to be used.
    #[error("device {device} has {axis_count} axes, but the rig uses its axis {number} as {name}")]
    NoAxis {
        /// Its address.
        device: u8,
        /// The number of the axis.
        number: u8,
        /// As what it is used.
        name: AxisName,
        /// How many it has.
        axis_count: i64,
    },
    /// A setting of an axis is not what the rig relies on.
    #[error(
        "the controller has {setting} = {found} on {name}, but the rig needs {needed}: correct the rig file, or the \
         controller's setting by its own tools; nothing was changed"
    )]
    Setting {
        /// The setting.
        setting: &'static str,
        /// As what the axis is used.
        name: AxisName,
        /// Its value.
        found: i64,
        /// What the rig needs.
        needed: i64,
    },
}

impl SessionError {
    pub(super) fn cause(&self) -> Cause {
        match self {
            Self::NoDevice { .. } | Self::Silent { .. } => Cause::Silent,
            Self::Refused { .. } => Cause::Protocol,
            Self::NoAxis { .. } | Self::Setting { .. } => Cause::Mismatch,
        }
    }
}
