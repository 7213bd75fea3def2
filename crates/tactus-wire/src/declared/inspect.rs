//! Decides whether bytes are a frame.

use super::Format;

/// What begins at a place in a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrameCandidate {
    /// No frame begins here.
    NoHead,
    /// A possible frame that has not arrived completely.
    Unfinished,
    /// The length field is wrong.
    BadLength { found: u64, expected: u64 },
    /// The trailer is wrong.
    BadTrailer,
    /// The checksum is wrong.
    BadChecksum { found: u64, expected: u64 },
    /// A complete frame.
    Good,
}

impl Format {
    /// What begins at the beginning of `bytes`.
    pub(super) fn inspect(&self, bytes: &[u8]) -> FrameCandidate {
        if !begins_like(bytes, &self.head) {
            return FrameCandidate::NoHead;
        }
        if let Some(length) = self.length {
            match length.field.read(bytes) {
                Some(found) if found != length.value => {
                    return FrameCandidate::BadLength { found, expected: length.value };
                }
                Some(_) | None => {}
            }
        }
        let Some(frame) = bytes.get(..self.bytes) else { return FrameCandidate::Unfinished };
        let end = frame.get(self.bytes - self.trailer.len()..).unwrap_or_default();
        if !begins_like(end, &self.trailer) {
            return FrameCandidate::BadTrailer;
        }
        if let Some(checksum) = &self.checksum {
            let covered = frame.get(checksum.from..checksum.to).unwrap_or_default();
            let expected = checksum.algorithm.of(covered).into();
            let found = checksum.field.read(frame).unwrap_or_default();
            if found != expected {
                return FrameCandidate::BadChecksum { found, expected };
            }
        }
        FrameCandidate::Good
    }

    /// Whether `bytes` begin like a frame; `None` if they are too short to decide.
    pub(super) fn stands_at(&self, bytes: &[u8]) -> Option<bool> {
        if !begins_like(bytes, &self.head) {
            return Some(false);
        }
        (bytes.len() >= self.head.len()).then_some(true)
    }

    /// Offset of the first beginning of a frame, complete or cut off by the end of the bytes.
    pub(super) fn find_head(&self, bytes: &[u8]) -> Option<usize> {
        let first = *self.head.first()?;
        let mut at = 0;
        loop {
            at += find_byte(first, bytes.get(at..)?)?;
            if begins_like(bytes.get(at..)?, &self.head) {
                return Some(at);
            }
            at += 1;
        }
    }
}

/// Whether `bytes` begin with `head`, as far as they reach.
fn begins_like(bytes: &[u8], head: &[u8]) -> bool {
    bytes.iter().zip(head).all(|(byte, expected)| byte == expected)
}

/// Offset of the first such byte. It compares blocks, which the compiler vectorises.
fn find_byte(wanted: u8, bytes: &[u8]) -> Option<usize> {
    let (blocks, _) = bytes.as_chunks::<32>();
    let has_none = |block: &&[u8; 32]| block.iter().fold(0, |any, byte| any | u8::from(*byte == wanted)) == 0;
    let without = 32 * blocks.iter().take_while(has_none).count();
    let rest = bytes.get(without..)?;
    rest.iter().position(|byte| *byte == wanted).map(|offset| without + offset)
}
