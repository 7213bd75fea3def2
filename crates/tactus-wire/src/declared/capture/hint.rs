//! What a report advises, in words.

use std::fmt;

use super::Stride;
use crate::declared::{Algorithm, Endian, Proposal};

/// How a description may be corrected.
#[derive(Debug, Clone, PartialEq)]
pub enum Hint {
    /// The sync bytes are nowhere.
    SyncAbsent {
        /// As described.
        sync: Vec<u8>,
        /// How often they are there in the opposite order.
        reversed: usize,
        /// What repeats in the capture instead.
        proposal: Option<Proposal>,
    },
    /// The sync bytes are there at another distance than the description says, or at none.
    FrameBytes {
        /// As described.
        described: usize,
        /// The distance that most have.
        found: Option<Stride>,
        /// How often the sync bytes are there.
        syncs: usize,
    },
    /// The length field says the same in all frames, but something else.
    LengthAdds {
        /// What it says.
        value: u64,
        /// What to write.
        adds: i64,
    },
    /// The length field would be right in the other byte order.
    LengthEndian {
        /// What to write.
        endian: Endian,
    },
    /// The length field is not the same in all frames, which are of one length.
    LengthVaries {
        /// Two of its values.
        values: [u64; 2],
    },
    /// Another checksum holds on nearly all frames.
    ChecksumIs {
        /// How it is computed.
        algorithm: Algorithm,
        /// The first byte that it covers.
        from: usize,
        /// The first byte behind those that it covers, and where it stands.
        offset: usize,
        /// Which byte of it is first.
        endian: Endian,
        /// What of it the description says otherwise; empty if it says that there is none.
        differs: Vec<&'static str>,
    },
    /// The checksum does not hold, and none that was tried does.
    ChecksumUnknown,
    /// The sequence does not count by one; some bytes do.
    SequenceAt {
        /// Their offsets.
        counters: Vec<usize>,
    },
    /// The timestamp goes back or jumps, and does not in the other byte order.
    TimestampEndian {
        /// What to write.
        endian: Endian,
    },
    /// The timestamp never changes.
    TimestampStands,
    /// Samples change less from frame to frame in the other byte order.
    SampleEndian {
        /// What to write.
        endian: Endian,
        /// How many times less.
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

/// Bytes as they are written in documents of formats.
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
