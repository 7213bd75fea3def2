//! Decodes messages from a stream of bytes.

use super::{Message, Packet};
use crate::lines::Lines;

/// Incomplete messages that are kept at the same time.
const PARTIAL_MAX: usize = 4;

/// Longest message that is assembled. The longest answers are lists of a few hundred bytes.
const MESSAGE_MAX_BYTES: usize = 4096;

/// Decodes messages on the host's side, and assembles those that come in parts. The result does not depend on how the
/// bytes arrive. Messages that are broken, too long or lack their beginning are dropped and counted.
#[derive(Debug, Clone, Default)]
pub struct Decoder {
    lines: Lines,
    assembly: Assembly,
}

#[derive(Debug, Clone, Default)]
struct Assembly {
    needs_checksums: bool,
    /// Incomplete messages, oldest first, with the number of parts after the first.
    partial: Vec<(Message, u32)>,
    dropped: u64,
}

impl Decoder {
    /// From now on, packets without a checksum count as broken.
    pub fn require_checksums(&mut self) {
        self.assembly.needs_checksums = true;
    }

    /// Takes bytes, and passes each complete message to `each`.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(Message)) {
        let assembly = &mut self.assembly;
        self.lines.push(bytes, |line| {
            if let Some(message) = assembly.take(line) {
                each(message);
            }
        });
    }

    /// Lines and messages that were dropped, since the start.
    pub fn dropped(&self) -> u64 {
        self.lines.dropped() + self.assembly.dropped
    }
}

impl Assembly {
    fn take(&mut self, line: &str) -> Option<Message> {
        let packet = Packet::parse(line).ok().filter(|packet| packet.checked || !self.needs_checksums);
        let Some(Packet { message, more, .. }) = packet else {
            self.dropped += 1;
            return None;
        };
        if let Message::Info { data, .. } = &message
            && let Some(part) =
                data.strip_prefix("cont").filter(|part| part.is_empty() || part.starts_with(' '))
        {
            return self.join(&message, part.trim_start(), more);
        }
        // A new message replaces an incomplete one with the same header.
        let before = self.partial.len();
        self.partial.retain(|(partial, _)| partial.header() != message.header());
        self.dropped += u64::from(before != self.partial.len());
        if !more {
            return Some(message);
        }
        if self.partial.len() >= PARTIAL_MAX {
            self.partial.remove(0);
            self.dropped += 1;
        }
        self.partial.push((message, 0));
        None
    }

    fn join(&mut self, message: &Message, part: &str, more: bool) -> Option<Message> {
        let at = self.partial.iter().position(|(partial, _)| partial.header() == message.header());
        let Some(at) = at else {
            self.dropped += 1;
            return None;
        };
        let (mut whole, parts) = self.partial.remove(at);
        let (number, text) = part.split_once(' ').unwrap_or((part, ""));
        let is_next = number.parse() == Ok(parts + 1);
        if !is_next || whole.data().len() + text.len() >= MESSAGE_MAX_BYTES {
            self.dropped += 1;
            return None;
        }
        let data = whole.data_mut();
        if !data.is_empty() {
            data.push(' ');
        }
        data.push_str(text);
        if more {
            self.partial.push((whole, parts + 1));
            return None;
        }
        Some(whole)
    }
}

#[cfg(test)]
#[path = "decoder_tests.rs"]
mod tests;
