//! Splits a stream of bytes into lines, for text protocols.

/// Longest line that is accepted. Lines of controllers are under 100 bytes.
const MAX_LINE_BYTES: usize = 256;

/// Splits a stream into lines. The result does not depend on how the bytes arrive. A line ends at CR or LF. Empty lines
/// are skipped; lines that are too long or not ASCII are dropped and counted.
#[derive(Debug, Clone, Default)]
pub struct Lines {
    line: Vec<u8>,
    overlong: bool,
    dropped: u64,
}

impl Lines {
    /// Takes bytes, and passes each complete line to `each`.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(&str)) {
        for byte in bytes {
            match byte {
                b'\r' | b'\n' => self.end(&mut each),
                _ if self.line.len() < MAX_LINE_BYTES => self.line.push(*byte),
                _ => self.overlong = true,
            }
        }
    }

    /// Lines that were dropped, since the start.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    fn end(&mut self, each: &mut impl FnMut(&str)) {
        match str::from_utf8(&self.line) {
            Ok(line) if line.is_ascii() && !self.overlong => {
                let line = line.trim();
                if !line.is_empty() {
                    each(line);
                }
            }
            _ => self.dropped += 1,
        }
        self.line.clear();
        self.overlong = false;
    }
}

#[cfg(test)]
#[path = "lines_tests.rs"]
mod tests;
