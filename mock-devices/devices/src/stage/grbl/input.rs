//! From the serial line to real-time bytes and lines.

use std::collections::VecDeque;

/// Size of the receive buffer; further bytes are lost, as on the real controller.
pub(super) const BUFFER_BYTES: usize = 128;

/// Longest line, without its end.
const LINE_BYTES: usize = 80;

/// Commands of one byte that bypass the line buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RealTime {
    /// `?`
    Report,
    /// `!`
    Hold,
    /// `~`
    Resume,
    /// 0x18
    Reset,
    /// 0x85
    CancelJog,
}

/// A line in the parser's form: upper case, without blanks and comments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Line {
    /// To be parsed; empty lines too.
    Text(String),
    /// It was too long.
    Overflow,
}

/// Received lines, and the beginning of the next.
#[derive(Debug, Default)]
pub(super) struct Input {
    lines: VecDeque<Vec<u8>>,
    begun: Vec<u8>,
}

impl Input {
    /// Takes one byte. Returns the command if it is a real-time byte.
    pub(super) fn push(&mut self, byte: u8) -> Option<RealTime> {
        match byte {
            b'?' => return Some(RealTime::Report),
            b'!' => return Some(RealTime::Hold),
            b'~' => return Some(RealTime::Resume),
            0x18 => return Some(RealTime::Reset),
            0x85 => return Some(RealTime::CancelJog),
            // Overrides and the safety door, which a stage does not have.
            0x80.. => {}
            _ if self.free_bytes() == 0 => {}
            b'\r' | b'\n' => self.lines.push_back(std::mem::take(&mut self.begun)),
            // Of a line that is too long, one byte more than its limit shows that it is.
            _ if self.begun.len() <= LINE_BYTES => self.begun.push(byte),
            _ => {}
        }
        None
    }

    /// Free bytes of the receive buffer.
    pub(super) fn free_bytes(&self) -> usize {
        let waiting: usize = self.lines.iter().map(|line| line.len() + 1).sum();
        BUFFER_BYTES.saturating_sub(waiting + self.begun.len())
    }

    /// Takes the next whole line.
    pub(super) fn take_line(&mut self) -> Option<Line> {
        let raw = self.lines.pop_front()?;
        Some(if raw.len() > LINE_BYTES { Line::Overflow } else { Line::Text(clean(&raw)) })
    }

    /// True if a whole line waits.
    pub(super) fn has_line(&self) -> bool {
        !self.lines.is_empty()
    }

    /// Discards everything.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}

/// Upper case, without blanks and comments.
fn clean(raw: &[u8]) -> String {
    let mut in_comment = false;
    let mut text = String::new();
    for byte in raw.iter().take_while(|byte| **byte != b';') {
        match byte {
            b'(' => in_comment = true,
            // Block delete is not supported: the character is ignored.
            b'/' => {}
            b')' => in_comment = false,
            _ if in_comment || *byte <= b' ' => {}
            _ => text.push(char::from(byte.to_ascii_uppercase())),
        }
    }
    text
}

#[cfg(test)]
#[path = "input_tests.rs"]
mod tests;
