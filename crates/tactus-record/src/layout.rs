//! Lengths inside MCAP records, checked before anything relies on them.
//!
//! The parser of the `mcap` crate trusts these lengths: it reserves memory by them and subtracts from them. So records with
//! wrong lengths must not reach it.

use mcap::records::op;

/// True if every length written in the record's body stays within the body.
pub(crate) fn fits(opcode: u8, body: &[u8]) -> bool {
    let mut fields = Fields { rest: body };
    let read = match opcode {
        op::SCHEMA => fields.skip(2).and_then(|()| fields.strings(3)),
        op::CHANNEL => fields.skip(4).and_then(|()| fields.strings(2)).and_then(|()| fields.map()),
        op::MESSAGE => fields.skip(22),
        op::METADATA => fields.strings(1).and_then(|()| fields.map()),
        op::ATTACHMENT => fields
            .skip(16)
            .and_then(|()| fields.strings(2))
            .and_then(|()| fields.blob())
            .and_then(|()| fields.skip(4))
            .filter(|()| fields.rest.is_empty()),
        _ => Some(()),
    };
    read.is_some()
}

/// The rest of a body. Each method removes a field from its front, or gives `None` if too little is left.
struct Fields<'a> {
    rest: &'a [u8],
}

impl Fields<'_> {
    fn skip(&mut self, bytes: usize) -> Option<()> {
        self.rest = self.rest.get(bytes..)?;
        Some(())
    }

    /// Strings, or byte arrays, behind 32-bit lengths.
    fn strings(&mut self, count: usize) -> Option<()> {
        for _ in 0..count {
            let (length, rest) = self.rest.split_first_chunk()?;
            self.rest = rest;
            self.skip(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
        }
        Some(())
    }

    /// Bytes behind a 64-bit length.
    fn blob(&mut self) -> Option<()> {
        let (length, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        self.skip(usize::try_from(u64::from_le_bytes(*length)).ok()?)
    }

    /// Pairs of strings behind the length of all of them.
    fn map(&mut self) -> Option<()> {
        let (length, rest) = self.rest.split_first_chunk()?;
        let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
        let (pairs, rest) = rest.split_at_checked(length)?;
        self.rest = rest;
        let mut pairs = Fields { rest: pairs };
        while !pairs.rest.is_empty() {
            pairs.strings(2)?;
        }
        Some(())
    }
}

#[cfg(test)]
#[path = "layout_tests.rs"]
mod tests;
