//! Lines out of a stream of bytes, for the protocols that speak in them.

/// Longest line that is believed; controllers' own are under 100 bytes.
const MAX_LINE_BYTES: usize = 256;

/// Cuts a stream into lines, whatever way it arrives. A line ends at CR or LF; empty ones are passed over,
/// overlong ones and those that are not ASCII are dropped and counted.
#[derive(Debug, Clone, Default)]
pub struct Lines {
    line: Vec<u8>,
    overlong: bool,
    dropped: u64,
}

impl Lines {
    /// Takes what arrived and hands each whole line to `each`.
    pub fn push(&mut self, bytes: &[u8], mut each: impl FnMut(&str)) {
        for byte in bytes {
            match byte {
                b'\r' | b'\n' => self.end(&mut each),
                _ if self.line.len() < MAX_LINE_BYTES => self.line.push(*byte),
                _ => self.overlong = true,
            }
        }
    }

    /// How many lines were dropped.
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
