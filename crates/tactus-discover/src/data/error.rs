//! Why a discovery fails.

use tactus_model::{EffectError, ModelError};

/// Why a discovery failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DiscoverError {
    /// The data do not suffice.
    #[error("{0}")]
    TooLittle(String),
    /// The declared parameters are no valid model.
    #[error("the declared model: {0}")]
    Model(#[from] ModelError),
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
