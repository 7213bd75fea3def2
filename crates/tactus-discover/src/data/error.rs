//! Why a discovery fails.

use tactus_model::{EffectError, ModelError, TrajectoryError};

/// Why a discovery failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DiscoverError {
    /// The data do not suffice; more of them would.
    #[error(transparent)]
    TooLittle(#[from] TooLittle),
    /// The declared model is none, or does not go together with the data. More data would not help.
    #[error(transparent)]
    Model(#[from] Mismatch),
    /// A known effect does not fit the array.
    #[error("the declared model: {0}")]
    Effect(#[from] EffectError),
    /// The operating system could not start the threads.
    #[error("cannot start {threads} threads: {reason}")]
    Threads {
        /// `Options::threads`.
        threads: usize,
        /// From the operating system.
        reason: String,
    },
}

/// Of what there is too little.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TooLittle {
    /// Of presses that can be fitted.
    #[error("{fitted} presses can be fitted; at least {least} are needed, and half as many to hold out")]
    FewPresses {
        /// Those that there are, without the held-out ones.
        fitted: usize,
        /// Those that are needed.
        least: usize,
    },
}

/// Why a declared model and the data do not go together.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Mismatch {
    /// The declared parameters are no valid model.
    #[error("the declared model: {0}")]
    Invalid(#[from] ModelError),
    /// The data name an indenter that the rig does not describe.
    #[error("the rig describes no indenter {id:?}; it describes {}", listed(known))]
    UnknownIndenter {
        /// Its id in the data.
        id: String,
        /// The indenters that the rig describes.
        known: Vec<String>,
    },
    /// The stage's path in the data is none.
    #[error("the stage's path: {0}")]
    Path(#[from] TrajectoryError),
}

impl From<ModelError> for DiscoverError {
    fn from(error: ModelError) -> Self {
        Self::Model(error.into())
    }
}

fn listed(known: &[String]) -> String {
    if known.is_empty() { "none".into() } else { known.join(", ") }
}

#[cfg(test)]
#[path = "error_tests.rs"]
mod tests;
