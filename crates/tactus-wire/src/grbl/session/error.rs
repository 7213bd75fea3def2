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
    /// Somebody has left an offset of the work frame.
    #[error(
        "the controller's work frame is offset by {} mm (G54, G92), and it is not known which frame the rig file means: clear \
         the offset (G10 L2 P1 X0 Y0 Z0, G92.1), and give the rig file's origins in machine coordinates; nothing was changed",
        texts.join(" ")
    )]
    WorkFrame {
        /// x, y and z of the controller, in mm, with three decimals.
        texts: [String; 3],
    },
}

impl SessionError {
    pub(super) fn of_work_frame(offset_mm: [f64; 3]) -> Self {
        Self::WorkFrame { texts: offset_mm.map(|mm| format!("{mm:.3}")) }
    }

    pub(super) fn cause(&self) -> Cause {
        match self {
            Self::NoBanner { .. } | Self::Silent { .. } => Cause::Silent,
            Self::Refused { .. } => Cause::Protocol,
            Self::Setting { .. } | Self::WorkFrame { .. } => Cause::Mismatch,
        }
    }
}
