//! Lengths inside MCAP records, checked before anything relies on them.
//!
//! The parser of the `mcap` crate trusts these lengths: it reserves memory by them and subtracts from them. So records with
//! wrong lengths must not reach it.

use mcap::records::op;

/// True if the lengths written in a record's body add up to the length of the body.
pub(crate) fn is_whole(opcode: u8, body: &[u8]) -> bool {
    match opcode {
        op::MESSAGE => body.len() >= 22,
        // Kinds of others' making.
        128.. => true,
        _ => inner_bytes(opcode, body) == Some(body.len()),
    }
}

/// Number of bytes of the record's body at the start of `bytes`, by the lengths written in it; `None` if fewer bytes are
/// there, or if the kind has no such lengths.
pub(crate) fn inner_bytes(opcode: u8, bytes: &[u8]) -> Option<usize> {
    let mut fields = Fields { rest: bytes };
    match opcode {
        op::HEADER => fields.strings(2),
        op::FOOTER => fields.skip(20),
        op::SCHEMA => fields.skip(2).and_then(|()| fields.strings(3)),
        op::CHANNEL => fields.skip(4).and_then(|()| fields.strings(2)).and_then(|()| fields.map()),
        op::CHUNK => fields.skip(28).and_then(|()| fields.strings(1)).and_then(|()| fields.blob()),
        op::MESSAGE_INDEX => fields.skip(2).and_then(|()| fields.strings(1)),
        op::CHUNK_INDEX => fields
            .skip(32)
            .and_then(|()| fields.strings(1))
            .and_then(|()| fields.skip(8))
            .and_then(|()| fields.strings(1))
            .and_then(|()| fields.skip(16)),
        op::ATTACHMENT => fields
            .skip(16)
            .and_then(|()| fields.strings(2))
            .and_then(|()| fields.blob())
            .and_then(|()| fields.skip(4)),
        op::ATTACHMENT_INDEX => fields.skip(40).and_then(|()| fields.strings(2)),
        op::STATISTICS => fields.skip(42).and_then(|()| fields.strings(1)),
        op::METADATA => fields.strings(1).and_then(|()| fields.map()),
        op::METADATA_INDEX => fields.skip(16).and_then(|()| fields.strings(1)),
        op::SUMMARY_OFFSET => fields.skip(17),
        op::DATA_END => fields.skip(4),
        _ => None,
    }?;
    Some(bytes.len() - fields.rest.len())
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
