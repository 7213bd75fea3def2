//! Checksums, by their parameters.

use std::fmt;
use std::sync::Arc;

/// Algorithm of a checksum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Algorithm {
    /// The low byte of the sum of all bytes.
    Sum8,
    /// All bytes combined by exclusive or.
    Xor8,
    /// A cyclic redundancy check.
    Crc(Crc),
}

impl Algorithm {
    /// The checksum of `bytes`.
    pub fn of(&self, bytes: &[u8]) -> u32 {
        match self {
            Self::Sum8 => bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)).into(),
            Self::Xor8 => bytes.iter().fold(0, |all, byte| all ^ byte).into(),
            Self::Crc(crc) => crc.of(bytes),
        }
    }

    /// Its length in bytes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Sum8 | Self::Xor8 => 1,
            Self::Crc(crc) => crc.parameters.width.bytes(),
        }
    }
}

impl fmt::Display for Algorithm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sum8 => f.write_str("sum8"),
            Self::Xor8 => f.write_str("xor8"),
            Self::Crc(Crc {
                parameters: CrcParameters { width, polynomial, init, reflect, xorout }, ..
            }) => {
                let bits = 8 * width.bytes();
                let digits = 2 + 2 * width.bytes();
                write!(
                    f,
                    "crc{bits} with polynomial = {polynomial:#0digits$x}, init = {init:#0digits$x}, \
                     reflect = {reflect}, xorout = {xorout:#0digits$x}"
                )
            }
        }
    }
}

/// Parameters of a cyclic redundancy check, as in the public catalogues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CrcParameters {
    /// Width of the result.
    pub width: CrcWidth,
    /// Polynomial without its highest bit, not reflected.
    pub polynomial: u32,
    /// Initial value, not reflected.
    pub init: u32,
    /// Process input and output with the lowest bit first.
    pub reflect: bool,
    /// The result is combined with this by exclusive or.
    pub xorout: u32,
}

/// Width of a cyclic redundancy check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CrcWidth {
    /// 16 bits.
    Bits16,
    /// 32 bits.
    Bits32,
}

impl CrcWidth {
    fn bytes(self) -> usize {
        match self {
            Self::Bits16 => 2,
            Self::Bits32 => 4,
        }
    }

    /// Bits above the result in a word of 32.
    fn above(self) -> u32 {
        match self {
            Self::Bits16 => 16,
            Self::Bits32 => 0,
        }
    }
}

/// The CRC-32 of Ethernet and zip.
pub const CRC32: CrcParameters = CrcParameters {
    width: CrcWidth::Bits32,
    polynomial: 0x04C1_1DB7,
    init: 0xFFFF_FFFF,
    reflect: true,
    xorout: 0xFFFF_FFFF,
};

/// A cyclic redundancy check with its tables. Clones share the tables.
#[derive(Clone)]
pub struct Crc {
    parameters: CrcParameters,
    /// Tables for eight bytes at a time: entry `[k][b]` is byte `b` followed by `k` zero bytes.
    tables: Arc<[[u32; 256]; 8]>,
}

impl Crc {
    /// Computes the tables.
    pub fn new(parameters: CrcParameters) -> Self {
        Self { parameters, tables: Arc::new(tables(parameters)) }
    }

    /// Width, polynomial, start value and reflections.
    pub fn parameters(&self) -> CrcParameters {
        self.parameters
    }

    /// The checksum of `bytes`.
    pub fn of(&self, bytes: &[u8]) -> u32 {
        // A result that is not reflected is kept at the top of the word, so that both widths use the same code.
        let CrcParameters { width, init, reflect, xorout, .. } = self.parameters;
        let top = init << width.above();
        let result = if reflect {
            self.lowest_first(top.reverse_bits(), bytes)
        } else {
            self.highest_first(top, bytes)
        };
        let result = if reflect { result } else { result >> width.above() };
        result ^ xorout
    }

    fn lowest_first(&self, mut crc: u32, bytes: &[u8]) -> u32 {
        let (eights, rest) = bytes.as_chunks::<8>();
        // The update is linear over exclusive or, so the bytes of a block can be looked up independently.
        for &[b0, b1, b2, b3, b4, b5, b6, b7] in eights {
            let [c0, c1, c2, c3] = crc.to_le_bytes();
            crc = self.block([b0 ^ c0, b1 ^ c1, b2 ^ c2, b3 ^ c3, b4, b5, b6, b7]);
        }
        for byte in rest {
            let [lowest, ..] = crc.to_le_bytes();
            crc = (crc >> 8) ^ self.at(0, lowest ^ byte);
        }
        crc
    }

    fn highest_first(&self, mut crc: u32, bytes: &[u8]) -> u32 {
        let (eights, rest) = bytes.as_chunks::<8>();
        for &[b0, b1, b2, b3, b4, b5, b6, b7] in eights {
            let [c0, c1, c2, c3] = crc.to_be_bytes();
            crc = self.block([b0 ^ c0, b1 ^ c1, b2 ^ c2, b3 ^ c3, b4, b5, b6, b7]);
        }
        for byte in rest {
            let [highest, ..] = crc.to_be_bytes();
            crc = (crc << 8) ^ self.at(0, highest ^ byte);
        }
        crc
    }

    fn block(&self, [b0, b1, b2, b3, b4, b5, b6, b7]: [u8; 8]) -> u32 {
        self.at(7, b0)
            ^ self.at(6, b1)
            ^ self.at(5, b2)
            ^ self.at(4, b3)
            ^ self.at(3, b4)
            ^ self.at(2, b5)
            ^ self.at(1, b6)
            ^ self.at(0, b7)
    }

    #[expect(clippy::indexing_slicing, reason = "tables are 0 to 7; a byte is an index into a table of 256")]
    fn at(&self, table: usize, byte: u8) -> u32 {
        self.tables[table][usize::from(byte)]
    }
}

impl PartialEq for Crc {
    fn eq(&self, other: &Self) -> bool {
        self.parameters == other.parameters
    }
}

impl Eq for Crc {}

impl fmt::Debug for Crc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Crc").field("parameters", &self.parameters).finish_non_exhaustive()
    }
}

fn tables(CrcParameters { width, polynomial, reflect, .. }: CrcParameters) -> [[u32; 256]; 8] {
    let polynomial = polynomial << width.above();
    // One byte and then `zeros` zero bytes, bit by bit.
    let entry = |byte: u32, zeros: usize| {
        let bits = 8 * (zeros + 1);
        if reflect {
            let polynomial = polynomial.reverse_bits();
            (0..bits).fold(byte, |crc, _| (crc >> 1) ^ if crc & 1 == 0 { 0 } else { polynomial })
        } else {
            (0..bits).fold(byte << 24, |crc, _| (crc << 1) ^ if crc >> 31 == 0 { 0 } else { polynomial })
        }
    };
    core::array::from_fn(|zeros| {
        let mut byte = 0;
        [(); 256].map(|()| {
            let entry = entry(byte, zeros);
            byte += 1;
            entry
        })
    })
}

#[cfg(test)]
#[path = "checksum_tests.rs"]
mod tests;
