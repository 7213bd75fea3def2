//! Commands of the host.

use super::checksum::{checksum, verify};
use super::packet::Fields;
use crate::lines::Lines;

/// A command of the host to one device or all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HostCommand {
    /// Address of the device, 1 to 99; 0 for all devices.
    pub device: u8,
    /// Number of the axis, 1 to 9; 0 for the device and all its axes.
    pub axis: u8,
    /// Message id, 0 to 99. The answer repeats it.
    pub id: Option<u8>,
    /// The command's words, such as `get pos`. An empty command requests only the status.
    pub text: String,
}

impl HostCommand {
    /// The line, with its end.
    pub fn encode(&self, with_checksum: bool) -> Vec<u8> {
        let Self { device, axis, id, text } = self;
        let id = id.map(|id| format!(" {id:02}")).unwrap_or_default();
        let blank = if text.is_empty() { "" } else { " " };
        let content = format!("{device} {axis}{id}{blank}{text}");
        let sum =
            if with_checksum { format!(":{:02X}", checksum(content.as_bytes())) } else { String::new() };
        format!("/{content}{sum}\n").into_bytes()
    }

    /// Parses a line, without its end: `/`, address, axis, id and words. The id, then the axis, then the address may be
    /// omitted. `None` if it is no command, comes in parts or has a wrong checksum; a device then stays silent.
    pub fn parse(line: &str) -> Option<Self> {
        let (content, _) = verify(line.strip_prefix('/')?)?;
        if content.ends_with('\\') {
            return None;
        }
        let mut fields = Fields(content);
        let device = fields.number(99);
        let axis = device.and_then(|_| fields.number(9));
        let id = axis.and_then(|_| fields.id());
        let text = fields.rest();
        let text = text.strip_prefix("--").map_or(text.as_str(), str::trim_start).to_owned();
        Some(Self { device: device.unwrap_or(0), axis: axis.unwrap_or(0), id, text })
    }
}

/// Decodes commands on the device's side, for virtual devices. The result does not depend on how the bytes arrive. Other
/// lines are dropped and counted.
#[derive(Debug, Clone, Default)]
pub struct HostCommandDecoder {
    lines: Lines,
    broken: u64,
}

impl HostCommandDecoder {
    /// Takes bytes, and passes each command to `each`.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(HostCommand)) {
        let broken = &mut self.broken;
        self.lines.push(bytes, |line| match HostCommand::parse(line) {
            Some(command) => each(command),
            None => *broken += 1,
        });
    }

    /// Lines that were dropped, since the start.
    pub fn dropped(&self) -> u64 {
        self.lines.dropped() + self.broken
    }
}

#[cfg(test)]
#[path = "command_tests.rs"]
mod tests;
