//! What can be done by hand to a virtual USB device: `sensor unplug`, as a line.

use std::time::Duration;

use crate::faults::duration;

/// Something that is done to a device or its plug.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Command {
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
pub(super) enum CommandError {
    /// An argument that the command does not take.
    #[error("{command} takes {wanted}, not {found:?}")]
    Argument {
        /// The command.
        command: &'static str,
        /// What it takes.
        wanted: &'static str,
        /// What stood there.
        found: String,
    },
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

impl Command {
    /// The device and what is to be done to it; `None` if the line is no such command, but perhaps a fault.
    pub(super) fn parse(line: &str) -> Option<(&str, Result<Self, CommandError>)> {
        let words: Vec<_> = line.split_whitespace().collect();
        let (device, command, arguments) = match words[..] {
            [device, command, ref arguments @ ..] => (device, command, arguments.join(" ")),
            _ => return None,
        };
        let nothing = |name, command: Self| match &arguments[..] {
            "" => Ok(command),
            _ => Err(CommandError::Argument {
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
            "slow" => duration(&arguments).map(Self::Slow).ok_or(CommandError::Argument {
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
