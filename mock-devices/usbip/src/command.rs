//! What can be done by hand to a virtual USB device: `sensor unplug`, as a line.

use std::time::Duration;

use tactus_virtual::faults::duration;

/// Something that is done to a device or its plug.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlugCommand {
    /// `unplug`: the cable comes out.
    Unplug,
    /// `plug`: it goes in again, where it was.
    Plug,
    /// `plug elsewhere`: it goes in again, in another port.
    PlugElsewhere,
    /// `halt`: the endpoint that sends stalls, until the host clears that.
    Halt,
    /// `slow 50ms`: answers one transfer in this time; `slow 0s` ends it.
    Slow(Duration),
}

/// Why a command cannot be done.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum PlugCommandError {
    /// An argument that the command does not take.
    #[error("{command} takes {wanted}, not {found:?}")]
    Argument { command: &'static str, wanted: &'static str, found: String },
    /// There is nothing at the host.
    #[error("it is not plugged in")]
    NotPlugged,
    /// It is there already.
    #[error("it is plugged in already")]
    Plugged,
    /// The system refused.
    #[error("{0}")]
    Refused(String),
}

impl PlugCommand {
    /// The device and what is to be done to it; `None` if the line is no such command, but perhaps a fault.
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
