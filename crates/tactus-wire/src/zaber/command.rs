//! What a host says.

use super::checksum::{checksum, verify};
use super::packet::Fields;
use crate::lines::Lines;

/// A command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HostCommand {
    /// Address of the device, 1 to 99; 0 means all of them.
    pub device: u8,
    /// Number of the axis, 1 to 9; 0 means the device and all its axes.
    pub axis: u8,
    /// The answer carries the same id, 0 to 99.
    pub id: Option<u8>,
    /// What is to be done, `get pos` for instance. An empty command asks for the status alone.
    pub text: String,
}

impl HostCommand {
    /// The bytes that a host sends.
    pub fn encode(&self, with_checksum: bool) -> Vec<u8> {
        let Self { device, axis, id, text } = self;
        let id = id.map(|id| format!(" {id:02}")).unwrap_or_default();
        let blank = if text.is_empty() { "" } else { " " };
        let content = format!("{device} {axis}{id}{blank}{text}");
        let sum =
            if with_checksum { format!(":{:02X}", checksum(content.as_bytes())) } else { String::new() };
        format!("/{content}{sum}\n").into_bytes()
    }

    /// Reads a line, without its end: `/`, then address, axis and id, each of which may be missing from the
    /// right, then the command. `None` if it is no command or its checksum is wrong: a device keeps silent
    /// then. A command in parts is not understood.
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

/// The device's ear, for virtual devices: cuts a stream into commands, whatever way it arrives. What is no
/// command is dropped and counted.
#[derive(Debug, Clone, Default)]
pub struct HostCommandDecoder {
    lines: Lines,
    broken: u64,
}

impl HostCommandDecoder {
    /// Takes what arrived and hands each command to `each`.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(HostCommand)) {
        let broken = &mut self.broken;
        self.lines.push(bytes, |line| match HostCommand::parse(line) {
            Some(command) => each(command),
            None => *broken += 1,
        });
    }

    /// How many lines were dropped.
    pub fn dropped(&self) -> u64 {
        self.lines.dropped() + self.broken
    }
}

#[cfg(test)]
#[path = "command_tests.rs"]
mod tests;
