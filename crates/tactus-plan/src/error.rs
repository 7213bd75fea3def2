//! Errors of a script.

use serde::{Deserialize, Serialize};

use crate::{Exceeded, Location, Refusal};

/// Why a script was refused or ended early. The text begins with the script's line where there is one.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum ScriptError {
    /// Not Starlark, or something that experiment scripts may not use.
    #[error("{at}: {problem}")]
    Syntax {
        /// Where in the script the error is.
        at: Location,
        /// What is wrong with it.
        problem: String,
    },
    /// A line failed: a wrong operand, a wrong argument, the script's own `fail`.
    #[error("{at}: {problem}")]
    Evaluation {
        /// The innermost line of the script.
        at: Location,
        /// What is wrong.
        problem: String,
        /// The calls that led to the line, with the text of each line.
        call_stack: String,
    },
    /// A step was not performed.
    #[error("{at}: {refusal}")]
    Refused {
        /// The line that asked for the step.
        at: Location,
        /// Why it was not done.
        refusal: Refusal,
        /// The calls that led to the line, with the text of each line.
        call_stack: String,
    },
    /// The script exceeded a limit.
    #[error("{at}: {exceeded}")]
    Limit {
        /// The line in execution; that of the last step if the process ended.
        at: Location,
        /// Which limit, with its value.
        exceeded: Exceeded,
        /// The calls that led to the line, with the text of each line; empty if the thread had to be left behind or the
        /// process ended.
        call_stack: String,
    },
    /// A parameter does not exist or cannot have the given value.
    #[error("{script}: {problem}")]
    Argument {
        /// The script's name, without the suffix.
        script: String,
        /// What is wrong, and what would be right.
        problem: String,
    },
    /// The arguments cannot be read at all.
    #[error("{0}")]
    Malformed(String),
    /// The evaluator itself failed.
    #[error("{script}: the evaluator broke: {problem}")]
    Evaluator {
        /// The script's name, without the suffix.
        script: String,
        /// What is known about it.
        problem: String,
    },
}

impl ScriptError {
    /// The line at fault, where there is one.
    pub fn at(&self) -> Option<&Location> {
        match self {
            Self::Syntax { at, .. }
            | Self::Evaluation { at, .. }
            | Self::Refused { at, .. }
            | Self::Limit { at, .. } => Some(at),
            Self::Argument { .. } | Self::Malformed(_) | Self::Evaluator { .. } => None,
        }
    }

    /// The calls that led to that line, outermost first; empty for errors without a line in execution.
    pub fn call_stack(&self) -> &str {
        match self {
            Self::Evaluation { call_stack, .. }
            | Self::Refused { call_stack, .. }
            | Self::Limit { call_stack, .. } => call_stack,
            Self::Syntax { .. } | Self::Argument { .. } | Self::Malformed(_) | Self::Evaluator { .. } => "",
        }
    }
}
