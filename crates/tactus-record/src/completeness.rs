//! How much of a recording could be read.

use std::fmt;

use serde::Serialize;

/// How much of a file could be read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum Completeness {
    /// All of it, to the end mark, with every checksum right.
    Complete,
    /// Everything before a byte; what should follow is missing.
    Truncated {
        /// Everything before this byte was read.
        at_byte: u64,
        /// What is wrong there.
        reason: String,
    },
    /// Everything around the damaged places.
    Damaged(Damage),
}

/// The damaged places of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Damage {
    /// Number of damaged places.
    pub places: u64,
    /// Number of chunks whose messages are lost.
    pub chunks: u64,
    /// Number of bytes that could not be read; 0 if only a checksum says that something is wrong.
    pub bytes: u64,
    /// The first damaged place.
    pub at_byte: u64,
    /// What is wrong there.
    pub reason: String,
    /// True if only the index at the end is damaged, which repeats what the rest says.
    pub index_only: bool,
    /// Where the file is cut off besides; `None` if its end is there.
    pub cut_at_byte: Option<u64>,
}

impl Completeness {
    /// True if something that was written may be missing from what was read. An index that is damaged, or an end mark that
    /// was never written, hides nothing. `bytes` is the size of the file.
    pub(crate) fn is_lossy(&self, bytes: u64) -> bool {
        match self {
            Self::Complete => false,
            Self::Truncated { at_byte, .. } => *at_byte < bytes,
            Self::Damaged(damage) => !damage.index_only,
        }
    }
}

impl fmt::Display for Completeness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Complete => f.write_str("complete"),
            Self::Truncated { at_byte, reason } => write!(f, "readable up to byte {at_byte}: {reason}"),
            Self::Damaged(Damage { places, chunks, bytes, at_byte, reason, index_only, cut_at_byte }) => {
                let places = if *places == 1 { "one place".to_owned() } else { format!("{places} places") };
                let index = if *index_only { ", only in its index" } else { "" };
                let plural = if *chunks == 1 { "" } else { "s" };
                write!(
                    f,
                    "damaged in {places}{index} ({chunks} chunk{plural} of messages, {bytes} bytes); "
                )?;
                write!(f, "the first is at byte {at_byte}: {reason}")?;
                match cut_at_byte {
                    Some(at_byte) => write!(f, "; cut off at byte {at_byte}"),
                    None => Ok(()),
                }
            }
        }
    }
}

/// Collects the damage of a file while it is read.
#[derive(Debug, Default)]
pub(crate) struct DamageNotes {
    damage: Option<Damage>,
}

impl DamageNotes {
    /// True if nothing was wrong so far.
    pub(crate) fn none(&self) -> bool {
        self.damage.is_none()
    }

    /// Notes a damaged place. Returns the whole, so that more can be added.
    pub(crate) fn place(
        &mut self,
        at_byte: u64,
        reason: impl FnOnce() -> String,
        in_index: bool,
    ) -> &mut Damage {
        let damage = self.damage.get_or_insert_with(|| Damage {
            places: 0,
            chunks: 0,
            bytes: 0,
            at_byte,
            reason: reason(),
            index_only: true,
            cut_at_byte: None,
        });
        damage.places += 1;
        damage.index_only &= in_index;
        damage
    }

    /// The verdict on a file that is cut off.
    pub(crate) fn cut(&mut self, at_byte: u64, reason: String) -> Completeness {
        match self.damage.take() {
            None => Completeness::Truncated { at_byte, reason },
            Some(damage) => {
                Completeness::Damaged(Damage { cut_at_byte: Some(at_byte), index_only: false, ..damage })
            }
        }
    }

    /// The verdict on a file whose end is there.
    pub(crate) fn ended(&mut self) -> Completeness {
        self.damage.take().map_or(Completeness::Complete, Completeness::Damaged)
    }
}
