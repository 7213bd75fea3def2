//! The checksum.

/// Greatest number of bytes that are looked up together.
const BLOCK_BYTES: usize = 16;

/// Entry `[k][b]` is the checksum, from 0 on, of byte `b` followed by `k` zero bytes.
static TABLES: [[u16; 256]; BLOCK_BYTES] = tables();

/// The checksum of `bytes`, with the initial value 0xFFFF.
///
/// For each byte `crc = (crc >> 8) ^ T[(crc ^ byte) & 0xFF]`, where `T` is the table of the
/// polynomial 0x1021 for most-significant-bit-first use. Table and shift do not match, so it is not a standard CRC:
/// `"123456789"` gives 0x6EB4.
pub fn crc(bytes: &[u8]) -> u16 {
    update(0xFFFF, bytes)
}

/// Continues the checksum `crc` over `bytes`.
pub(super) fn update(crc: u16, bytes: &[u8]) -> u16 {
    let (blocks, rest) = bytes.as_chunks::<BLOCK_BYTES>();
    let (fours, rest) = rest.as_chunks::<4>();
    let crc = blocks.iter().fold(crc, update_block);
    let crc = fours.iter().fold(crc, update_block);
    rest.iter().fold(crc, |crc, byte| crc >> 8 ^ update_block(crc & 0xFF, &[*byte]))
}

/// Continues over a block. The update is linear over xor, so each byte is looked up for itself. Only the first two of them wait
/// for the block before; they come last.
#[expect(
    clippy::indexing_slicing,
    reason = "a byte is an index into a table of 256; no block is longer than the tables"
)]
fn update_block<const BYTES: usize>(crc: u16, block: &[u8; BYTES]) -> u16 {
    let [low, high] = crc.to_le_bytes();
    block.iter().enumerate().rev().fold(0, |crc, (at, byte)| {
        let before = match at {
            0 => low,
            1 => high,
            _ => 0,
        };
        crc ^ TABLES[BYTES - 1 - at][usize::from(byte ^ before)]
    })
}

#[expect(clippy::indexing_slicing, reason = "constant bounds, evaluated by the compiler")]
const fn tables() -> [[u16; 256]; BLOCK_BYTES] {
    let mut tables = [[0; 256]; BLOCK_BYTES];
    let mut byte = 0;
    while byte < 256 {
        #[expect(clippy::cast_possible_truncation, reason = "below 256")]
        let mut entry = (byte as u16) << 8;
        let mut bit = 0;
        while bit < 8 {
            entry = if entry & 0x8000 == 0 { entry << 1 } else { (entry << 1) ^ 0x1021 };
            bit += 1;
        }
        tables[0][byte] = entry;
        byte += 1;
    }
    let mut zeros = 1;
    while zeros < BLOCK_BYTES {
        let mut byte = 0;
        while byte < 256 {
            let before = tables[zeros - 1][byte];
            tables[zeros][byte] = (before >> 8) ^ tables[0][(before & 0xFF) as usize];
            byte += 1;
        }
        zeros += 1;
    }
    tables
}

#[cfg(test)]
#[path = "crc_tests.rs"]
mod tests;
