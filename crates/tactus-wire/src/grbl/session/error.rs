//! Why a session is over.

use crate::stage::Cause;

/// Why a session is over.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum SessionError {
    /// No banner came after several resets.
    #[error("no banner came after {resets} resets: is this a Grbl controller, and is the bit rate right?")]
    NoBanner { resets: u32 },
    /// The controller stopped answering.
    #[error("the controller did not answer {query}")]
    Silent { query: &'static str },
    /// The controller refused a necessary query.
    #[error("the controller refused {query}: error {code}, {meaning}")]
    Refused { query: &'static str, code: u8, meaning: &'static str },
    /// A setting of the controller differs from the rig's requirement.
    #[error(
        "the controller has ${number} = {found}, but the rig needs {needed}: correct the rig file, or the \
         controller's setting by its own tools; nothing was changed"
    )]
    Setting { number: u16, found: String, needed: String },
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
