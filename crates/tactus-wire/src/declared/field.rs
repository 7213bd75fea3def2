//! A number within a frame.

use super::Endian;

/// An unsigned whole number within a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Offset of its first byte from the beginning of the frame.
    pub offset: usize,
    /// Its length in bytes, 1 to 8.
    pub width: usize,
    /// Its byte order.
    pub endian: Endian,
}

impl Field {
    /// Its value in a frame; `None` if the frame ends before it.
    pub fn read(&self, frame: &[u8]) -> Option<u64> {
        let bytes = frame.get(self.offset..self.offset.checked_add(self.width)?)?;
        let join = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        Some(match self.endian {
            Endian::Little => bytes.iter().rev().fold(0, join),
            Endian::Big => bytes.iter().fold(0, join),
        })
    }

    /// Writes the low bytes of `value`, as far as the frame reaches.
    pub(super) fn write(&self, frame: &mut [u8], value: u64) {
        let bytes = frame.iter_mut().skip(self.offset).take(self.width);
        match self.endian {
            Endian::Little => {
                for (to, from) in bytes.zip(value.to_le_bytes()) {
                    *to = from;
                }
            }
            Endian::Big => {
                for (to, from) in bytes.rev().zip(value.to_le_bytes()) {
                    *to = from;
                }
            }
        }
    }

    /// Number of its possible values: 2^8 to 2^64.
    pub(super) fn values(&self) -> u128 {
        1 << (8 * self.width.min(8))
    }
}

#[cfg(test)]
#[path = "field_tests.rs"]
mod tests;
