//! Records which bytes of a frame are used by which field.

use super::{Endian, Field, FormatError};

/// The bytes of a frame that are used, with the name of the field.
pub(super) struct Layout {
    pub(super) bytes: usize,
    taken: Vec<(String, usize, usize)>,
}

impl Layout {
    /// A frame without any used bytes.
    pub(super) fn new(bytes: usize) -> Self {
        Self { bytes, taken: Vec::new() }
    }

    /// A number field; marks its bytes as used.
    pub(super) fn field(
        &mut self,
        name: &str,
        offset: i64,
        width: usize,
        endian: Endian,
    ) -> Result<Field, FormatError> {
        if !(1..=8).contains(&width) {
            return Err(wrong(&format!("{name}.width"), format!("{width} is not 1 to 8")));
        }
        let name = format!("{name}.offset");
        let offset = self.offset(&name, offset)?;
        self.take(&name, offset, width)?;
        Ok(Field { offset, width, endian })
    }

    /// Converts an offset of a byte to one from the beginning.
    pub(super) fn offset(&self, field: &str, offset: i64) -> Result<usize, FormatError> {
        self.end(field, offset).and_then(|at| {
            if at < self.bytes {
                return Ok(at);
            }
            Err(wrong(field, format!("{offset} is behind the frame of {} bytes", self.bytes)))
        })
    }

    /// Converts an offset, which may be the frame's end, to one from the beginning.
    pub(super) fn end(&self, field: &str, offset: i64) -> Result<usize, FormatError> {
        let from_end =
            usize::try_from(offset.unsigned_abs()).ok().and_then(|back| self.bytes.checked_sub(back));
        let at = if offset < 0 { from_end } else { usize::try_from(offset).ok() };
        at.filter(|at| *at <= self.bytes).ok_or_else(|| {
            wrong(field, format!("{offset} is outside the frame of {} bytes (frame.bytes)", self.bytes))
        })
    }

    /// Marks bytes as used by `field`.
    pub(super) fn take(&mut self, field: &str, from: usize, bytes: usize) -> Result<(), FormatError> {
        let to = from.saturating_add(bytes);
        if to > self.bytes {
            let problem = format!(
                "{bytes} bytes from byte {from} on end at {to}, behind the frame of {}; correct one of them",
                self.bytes
            );
            return Err(wrong(field, problem));
        }
        let other = self.taken.iter().find(|(_, other_from, other_to)| from < *other_to && *other_from < to);
        if let Some((other, other_from, other_to)) = other {
            let problem = format!(
                "bytes {from} to {} are those of {other} too, which has {other_from} to {}; correct one",
                to - 1,
                other_to - 1
            );
            return Err(wrong(field, problem));
        }
        self.taken.push((field.to_owned(), from, to));
        Ok(())
    }

    pub(super) fn does_not_fit(&self, field: &str, bytes: usize) -> FormatError {
        wrong(field, format!("{bytes} bytes do not fit into a frame of {} bytes (frame.bytes)", self.bytes))
    }
}

/// An error of a field, with what to do.
pub(super) fn wrong(field: &str, problem: impl Into<String>) -> FormatError {
    FormatError { field: field.to_owned(), problem: problem.into() }
}
