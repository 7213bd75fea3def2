//! Advice on correcting a description.

use std::fmt;

use super::Stride;
use crate::declared::{Algorithm, Endian, Proposal};

/// A possible correction of a description.
#[derive(Debug, Clone, PartialEq)]
pub enum Hint {
    /// The sync bytes do not occur.
    SyncAbsent {
        /// As in the description.
        sync: Vec<u8>,
        /// Number of occurrences in the opposite order.
        reversed: usize,
        /// What repeats in the capture instead.
        proposal: Option<Proposal>,
    },
    /// The sync bytes occur at another distance than described, or at no regular distance.
    FrameBytes {
        /// As in the description.
        described: usize,
        /// The most frequent distance.
        found: Option<Stride>,
        /// Number of occurrences of the sync bytes.
        syncs: usize,
    },
    /// The length field has the same wrong value in all frames.
    LengthAdds {
        /// Value of the field.
        value: u64,
        /// Value to write into the description.
        adds: i64,
    },
    /// The length field is right in the other byte order.
    LengthEndian {
        /// Value to write into the description.
        endian: Endian,
    },
    /// The length field varies, although all frames have the same length.
    LengthVaries {
        /// Two of its values.
        values: [u64; 2],
    },
    /// Another checksum is correct for nearly all frames.
    ChecksumIs {
        /// How it is computed.
        algorithm: Algorithm,
        /// Offset of the first byte that it covers.
        from: usize,
        /// Its own offset, which is also the end of the bytes that it covers.
        offset: usize,
        /// Its byte order.
        endian: Endian,
        /// Keys in which the description differs; empty if the description has no checksum.
        differs: Vec<&'static str>,
    },
    /// The checksum is wrong, and no other was found that is correct.
    ChecksumUnknown,
    /// The sequence does not count by one.
    SequenceAt {
        /// Offsets of the bytes that do.
        counters: Vec<usize>,
    },
    /// The timestamp goes back or jumps, but not in the other byte order.
    TimestampEndian {
        /// Value to write into the description.
        endian: Endian,
    },
    /// The timestamp never changes.
    TimestampStands,
    /// Samples change less between frames in the other byte order.
    SampleEndian {
        /// Value to write into the description.
        endian: Endian,
        /// Factor by which they change less.
        smoother: f64,
    },
}

impl fmt::Display for Hint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SyncAbsent { sync, reversed, proposal } => {
                write!(f, "frame.sync: the bytes {} are nowhere", Hex(sync))?;
                if *reversed > 1 {
                    write!(f, "; in the opposite order they are there {reversed} times")?;
                }
                if let Some(Proposal { stride, sync, first_at, .. }) = proposal {
                    write!(f, "; {} is there every {stride} bytes, first at {first_at}", Hex(sync))?;
                }
                Ok(())
            }
            Self::FrameBytes { described, found: Some(Stride { bytes, count }), syncs } => write!(
                f,
                "frame.bytes: sync is found every {bytes} bytes ({count} times of {syncs}), but the \
                 description says frames of {described}"
            ),
            Self::FrameBytes { described, found: None, syncs } => write!(
                f,
                "frame.sync: found {syncs} times, but neither every {described} bytes nor at another distance \
                 again and again; are these its bytes, and does the capture lack some?"
            ),
            Self::LengthAdds { value, adds } => {
                write!(f, "frame.length.adds: the field says {value} in every frame; write adds = {adds}")
            }
            Self::LengthEndian { endian } => {
                let endian = name(*endian);
                write!(
                    f,
                    "frame.length.endian: the field is right in the other byte order; write \"{endian}\""
                )
            }
            Self::LengthVaries { values: [a, b] } => write!(
                f,
                "frame.length.offset: the field says {a} and {b} in frames of one length; the length lies \
                 elsewhere, or leave it out"
            ),
            Self::ChecksumIs { algorithm, from, offset, endian, differs } => {
                let field =
                    differs.first().map_or("checksum".to_owned(), |first| format!("checksum.{first}"));
                write!(
                    f,
                    "{field}: the checksum holds if it is {algorithm}, covers from byte {from}, stands at byte \
                     {offset} and is \"{}\"",
                    name(*endian)
                )?;
                match differs.as_slice() {
                    [] => f.write_str("; the description has none"),
                    differs => write!(f, "; the description differs in {}", differs.join(", ")),
                }
            }
            Self::ChecksumUnknown => f.write_str(
                "checksum.kind: it does not hold, nor does any other that was tried, wherever the \
                 covered bytes begin; with \"none\" frames are read unprotected",
            ),
            Self::SequenceAt { counters } if counters.is_empty() => {
                f.write_str("sequence.offset: it does not count by one, nor does any byte; leave it out")
            }
            Self::SequenceAt { counters } => {
                let counters: Vec<String> = counters.iter().map(ToString::to_string).collect();
                let counters = counters.join(", ");
                write!(f, "sequence.offset: it does not count by one; these bytes do: {counters}")
            }
            Self::TimestampEndian { endian } => {
                let endian = name(*endian);
                write!(f, "timestamp.endian: it runs on evenly in the other byte order; write \"{endian}\"")
            }
            Self::TimestampStands => {
                f.write_str("timestamp.offset: it never changes; the clock lies elsewhere, or leave it out")
            }
            Self::SampleEndian { endian, smoother } => write!(
                f,
                "samples.endian: from frame to frame the samples change {smoother:.0} times less in the other \
                 byte order; write \"{}\"",
                name(*endian)
            ),
        }
    }
}

fn name(endian: Endian) -> &'static str {
    match endian {
        Endian::Little => "little",
        Endian::Big => "big",
    }
}

/// Displays bytes in hexadecimal, separated by spaces.
struct Hex<'a>(&'a [u8]);

impl fmt::Display for Hex<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, byte) in self.0.iter().enumerate() {
            let space = if index == 0 { "" } else { " " };
            write!(f, "{space}{byte:02X}")?;
        }
        Ok(())
    }
}
