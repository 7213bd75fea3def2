//! Resource limits of a script.

use std::borrow::Cow;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Longest line of `log` in bytes. The rest is cut off; the line then ends with its length.
pub const LOG_LINE_MAX_BYTES: usize = 4 << 10;

/// Bounds of one evaluation of a script. `Default` suffices for any experiment. The crate's documentation tells when each
/// is checked and what is not bounded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScriptLimits {
    /// Turns of loops and comprehensions, plus calls of functions and operators. Looked at once in a thousand.
    pub ticks: u64,
    /// Memory of the script's values.
    pub heap_bytes: usize,
    /// Greatest call depth.
    pub call_depth: usize,
    /// Steps asked of the host, `log` included.
    pub steps: u64,
    /// Text of all `log` lines together.
    pub log_bytes: usize,
    /// Computing time between two steps. The duration of the steps themselves is not limited.
    pub think: Duration,
    /// Processor time of the whole evaluation, where it has a process of its own.
    pub processor: Duration,
    /// Memory of the whole evaluation, where it has a process of its own: values, what holds them, and the evaluator.
    pub process_bytes: usize,
}

impl Default for ScriptLimits {
    fn default() -> Self {
        Self {
            ticks: 5_000_000,
            heap_bytes: 256 << 20,
            call_depth: 64,
            steps: 100_000,
            log_bytes: 1 << 20,
            think: Duration::from_secs(10),
            processor: Duration::from_mins(2),
            process_bytes: 512 << 20,
        }
    }
}

/// Which bound a script ran into.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error, Serialize, Deserialize)]
pub enum Exceeded {
    /// [`ScriptLimits::ticks`].
    #[error("the script's {0} loop turns and calls are used up: is there a loop without an end?")]
    Ticks(u64),
    /// [`ScriptLimits::heap_bytes`].
    #[error("the script's values take more than {} MiB", .0 >> 20)]
    Heap(usize),
    /// [`ScriptLimits::call_depth`].
    #[error("more than {0} functions are under way: does one call itself without an end?")]
    CallDepth(usize),
    /// [`ScriptLimits::steps`].
    #[error("the script asked for more than {0} steps")]
    Steps(u64),
    /// [`ScriptLimits::log_bytes`].
    #[error("the script's log lines have more than {} KiB together", .0 >> 10)]
    Log(usize),
    /// [`ScriptLimits::think`].
    #[error("the script computed for more than {:.1} s without asking for a step", .0.as_secs_f64())]
    Think(Duration),
    /// [`ScriptLimits::processor`].
    #[error("the script computed for more than {:.1} s altogether", .0.as_secs_f64())]
    Processor(Duration),
    /// [`ScriptLimits::process_bytes`].
    #[error("the script's process needs more than {} MiB", .0 >> 20)]
    Process(usize),
    /// The evaluator's stack: values nest too deep.
    #[error("the script's values nest too deep for the evaluator's stack of {} MiB", .0 >> 20)]
    Stack(usize),
    /// One value would be too large.
    #[error("{what} of {size} {unit}, the limit is {limit}")]
    Size {
        /// Kind of value, with its article.
        what: Cow<'static, str>,
        /// How large it would be; a lower bound if measuring was broken off.
        size: u64,
        /// Of what.
        unit: Cow<'static, str>,
        /// How large it may be.
        limit: u64,
    },
}
