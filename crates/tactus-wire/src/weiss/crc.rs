//! The checksum.

/// Tables for eight bytes at a time: entry `[k][b]` is byte `b` followed by `k` zero bytes.
static TABLES: [[u16; 256]; 8] = tables();

/// The checksum of `bytes`, with the initial value 0xFFFF.
///
/// For each byte `crc = (crc >> 8) ^ T[(crc ^ byte) & 0xFF]`, where `T` is the table of the
/// polynomial 0x1021 for most-significant-bit-first use. Table and shift do not match, so it is not a standard CRC:
/// `"123456789"` gives 0x6EB4.
pub fn crc(bytes: &[u8]) -> u16 {
    update(0xFFFF, bytes)
}

/// Continues the checksum `crc` over `bytes`.
#[expect(clippy::indexing_slicing, reason = "a byte is an index into a table of 256")]
pub(super) fn update(mut crc: u16, bytes: &[u8]) -> u16 {
    let at = |table: usize, byte: u8| TABLES[table][usize::from(byte)];
    let (eights, rest) = bytes.as_chunks::<8>();
    // The update is linear over xor, so the bytes of a block can be looked up independently.
    for &[b0, b1, b2, b3, b4, b5, b6, b7] in eights {
        let [low, high] = crc.to_le_bytes();
        crc = at(7, b0 ^ low)
            ^ at(6, b1 ^ high)
            ^ at(5, b2)
            ^ at(4, b3)
            ^ at(3, b4)
            ^ at(2, b5)
            ^ at(1, b6)
            ^ at(0, b7);
    }
    for &byte in rest {
        let [low, high] = crc.to_le_bytes();
        crc = u16::from(high) ^ at(0, byte ^ low);
    }
    crc
}

#[expect(clippy::indexing_slicing, reason = "constant bounds, evaluated by the compiler")]
const fn tables() -> [[u16; 256]; 8] {
    let mut tables = [[0; 256]; 8];
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
    while zeros < 8 {
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
