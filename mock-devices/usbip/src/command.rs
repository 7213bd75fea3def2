//! Commands for a virtual USB device, as lines such as `sensor unplug`.

use std::time::Duration;

use tactus_virtual::faults::duration;

/// A command for a USB device or its plug.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlugCommand {
    /// `unplug`: unplugs the cable.
    Unplug,
    /// `plug`: plugs it in again at the same port.
    Plug,
    /// `plug elsewhere`: plugs it in again at another port.
    PlugElsewhere,
    /// `halt`: the sending endpoint stalls until the host clears the halt.
    Halt,
    /// `slow 50ms`: answers at most one transfer per this time; `slow 0s` ends it.
    Slow(Duration),
}

/// Why a command cannot be done.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum PlugCommandError {
    /// The command does not take the argument.
    #[error("{command} takes {wanted}, not {found:?}")]
    Argument { command: &'static str, wanted: &'static str, found: String },
    /// The device is not at the host.
    #[error("it is not plugged in")]
    NotPlugged,
    /// The device is at the host already.
    #[error("it is plugged in already")]
    Plugged,
    /// The system refused.
    #[error("{0}")]
    Refused(String),
}

impl PlugCommand {
    /// Parses a line into the device's name and the command; `None` if it is no such command. It may be a fault.
    pub fn parse(line: &str) -> Option<(&str, Result<Self, PlugCommandError>)> {
        let words: Vec<_> = line.split_whitespace().collect();
        let (device, command, arguments) = match words[..] {
            [device, command, ref arguments @ ..] => (device, command, arguments.join(" ")),
            _ => return None,
        };
        let nothing = |name, command: Self| match &arguments[..] {
            "" => Ok(command),
            _ => Err(PlugCommandError::Argument {
                command: name,
                wanted: "nothing more",
                found: arguments.clone(),
            }),
        };
        let parsed = match command {
            "unplug" => nothing("unplug", Self::Unplug),
            "halt" => nothing("halt", Self::Halt),
            "plug" if arguments == "elsewhere" => Ok(Self::PlugElsewhere),
            "plug" => nothing("plug", Self::Plug),
            "slow" => duration(&arguments).map(Self::Slow).ok_or(PlugCommandError::Argument {
                command: "slow",
                wanted: "a duration such as 50ms, or 0s",
                found: arguments,
            }),
            _ => return None,
        };
        Some((device, parsed))
    }
}

#[cfg(test)]
#[path = "command_tests.rs"]
mod tests;
