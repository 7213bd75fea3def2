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

/// Greatest number of bytes that are looked up together.
const BLOCK_BYTES: usize = 16;

/// Entry `[k][b]` is the check, from 0 on, of byte `b` followed by `k` zero bytes.
type Tables = [[u32; 256]; BLOCK_BYTES];

/// A cyclic redundancy check with its tables. Clones share the tables.
#[derive(Clone)]
pub struct Crc {
    parameters: CrcParameters,
    tables: Arc<Tables>,
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
            self.update(top.reverse_bits(), bytes, u32::to_le_bytes, |crc| crc >> 8)
        } else {
            self.update(top, bytes, u32::to_be_bytes, |crc| crc << 8)
        };
        let result = if reflect { result } else { result >> width.above() };
        result ^ xorout
    }

    /// Continues `crc` over `bytes`. `split` gives the bytes of a check, the one that is due first in front; `shift` drops that one.
    fn update(&self, crc: u32, bytes: &[u8], split: fn(u32) -> [u8; 4], shift: fn(u32) -> u32) -> u32 {
        let (blocks, rest) = bytes.as_chunks::<BLOCK_BYTES>();
        let (fours, rest) = rest.as_chunks::<4>();
        let crc = blocks.iter().fold(crc, |crc, block| self.block(split(crc), block));
        let crc = fours.iter().fold(crc, |crc, block| self.block(split(crc), block));
        rest.iter().fold(crc, |crc, byte| shift(crc) ^ self.block(split(crc), &[*byte]))
    }

    /// The check of a block, from the bytes of the check before on. The check is linear over exclusive or, so each byte is looked
    /// up for itself. Only the first four of them wait for the block before; they come last.
    #[expect(
        clippy::indexing_slicing,
        reason = "a byte is an index into a table of 256; no block is longer than the tables"
    )]
    fn block<const BYTES: usize>(&self, before: [u8; 4], block: &[u8; BYTES]) -> u32 {
        block.iter().enumerate().rev().fold(0, |crc, (at, byte)| {
            let before = before.get(at).copied().unwrap_or_default();
            crc ^ self.tables[BYTES - 1 - at][usize::from(byte ^ before)]
        })
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

fn tables(CrcParameters { width, polynomial, reflect, .. }: CrcParameters) -> Tables {
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
