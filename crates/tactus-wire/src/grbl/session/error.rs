//! Why a session is over.

use crate::stage::Cause;

/// Why a session is over.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SessionError {
    /// No banner came.
    #[error("no banner came after {resets} resets: is this a Grbl controller, and is the bit rate right?")]
    NoBanner {
        /// How often the controller was reset.
        resets: u32,
    },
    /// The controller stopped answering.
    #[error("the controller did not answer {question}")]
    Silent {
        /// What was asked.
        question: &'static str,
    },
    /// The controller refused a question without which nothing can be done.
    #[error("the controller refused {question}: error {code}, {meaning}")]
    Refused {
        /// What was asked.
        question: &'static str,
        /// The controller's number.
        code: u8,
        /// What it means.
        meaning: &'static str,
    },
    /// A setting of the controller is not what the rig relies on.
    #[error(
        "the controller has ${number} = {found}, but the rig needs {needed}: correct the rig file, or the \
         controller's setting by its own tools; nothing was changed"
    )]
    Setting {
        /// Number of the setting.
        number: u16,
        /// Its value.
        found: String,
        /// What the rig needs.
        needed: String,
    },
}

impl SessionError {
    pub(super) fn cause(&self) -> Cause {
        match self {
            Self::NoBanner { .. } | Self::Silent { .. } => Cause::Silent,
            Self::Refused { .. } => Cause::Protocol,
            Self::Setting { .. } => Cause::Mismatch,
        }
    }
}
