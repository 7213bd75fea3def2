//! Why a session is over.

use crate::stage::{AxisName, Cause};
use crate::zaber::Rejection;

/// Why a session is over.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum SessionError {
    /// A device never answered.
    #[error(
        "device {device} does not answer: does it speak Zaber's ASCII protocol, and is the bit rate right?"
    )]
    NoDevice { device: u8 },
    /// A device stopped answering.
    #[error("device {device} did not answer to {command:?}")]
    Silent { device: u8, command: String },
    /// A device refused a necessary request.
    #[error("device {device} refused {command:?}: {rejection}")]
    Refused { device: u8, command: String, rejection: Rejection },
    /// A device has fewer axes than the rig uses.
    #[error("device {device} has {axis_count} axes, but the rig uses its axis {number} as {name}")]
    NoAxis { device: u8, number: u8, name: AxisName, axis_count: i64 },
    /// A setting of an axis differs from the rig's requirement.
    #[error(
        "the controller has {setting} = {found} on {name}, but the rig needs {needed}: correct the rig file, or the \
         controller's setting by its own tools; nothing was changed"
    )]
    Setting { setting: &'static str, name: AxisName, found: i64, needed: i64 },
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
