//! Faults at set times.

use std::time::Duration;

use serde::Deserialize;

use super::{FaultError, InjectedFault};

/// Faults at set times after the rig's start, earliest first.
///
/// ```toml
/// [[fault]]
/// at_s = 3.0
/// command = "sensor stall 2s"
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FaultScript {
    /// Sorted by time.
    pub faults: Vec<TimedFault>,
}

/// One fault and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedFault {
    /// Time since the rig was switched on.
    pub at: Duration,
    /// The injected fault.
    pub fault: InjectedFault,
}

/// Why a text is not a fault script. `index` counts the entries from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum FaultScriptError {
    /// Not TOML of the right form; the text names line and key.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// A time is not between 0 and 1e9 s.
    #[error("fault[{index}].at_s: seconds from 0 on, not {at_s}")]
    Time { index: usize, at_s: f64 },
    /// A command is not a fault.
    #[error("fault[{index}].command: {error}")]
    Command { index: usize, error: FaultError },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScript {
    #[serde(default)]
    fault: Vec<RawFault>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFault {
    at_s: f64,
    command: String,
}

impl FaultScript {
    /// Reads a script; its entries may be in any order.
    ///
    /// # Errors
    /// [`FaultScriptError`] names the line or the entry.
    pub fn from_toml(text: &str) -> Result<Self, FaultScriptError> {
        let raw: RawScript = toml::from_str(text)?;
        let mut faults = Vec::with_capacity(raw.fault.len());
        for (index, RawFault { at_s, command }) in raw.fault.into_iter().enumerate() {
            if !(0.0..1e9).contains(&at_s) {
                return Err(FaultScriptError::Time { index, at_s });
            }
            let fault = command.parse().map_err(|error| FaultScriptError::Command { index, error })?;
            faults.push(TimedFault { at: Duration::from_secs_f64(at_s), fault });
        }
        faults.sort_by_key(|fault| fault.at);
        Ok(Self { faults })
    }
}

#[cfg(test)]
#[path = "script_tests.rs"]
mod tests;
