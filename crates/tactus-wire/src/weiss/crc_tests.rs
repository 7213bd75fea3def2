use proptest::prelude::*;

use super::{crc, update};

#[test]
fn check_value() {
    assert_eq!(crc(b"123456789"), 0x6EB4);
}

#[test]
fn nothing_is_the_start_value() {
    assert_eq!(crc(b""), 0xFFFF);
}

/// The definition, bit by bit.
fn slow(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        let mut entry = ((crc ^ u16::from(*byte)) & 0xFF) << 8;
        for _ in 0..8 {
            entry = if entry & 0x8000 == 0 { entry << 1 } else { (entry << 1) ^ 0x1021 };
        }
        (crc >> 8) ^ entry
    })
}

proptest! {
    #[test]
    fn blocks_agree_with_the_definition(bytes: Vec<u8>, cut: proptest::sample::Index) {
        prop_assert_eq!(crc(&bytes), slow(&bytes));
        let (head, tail) = bytes.split_at(cut.index(bytes.len() + 1));
        prop_assert_eq!(update(crc(head), tail), slow(&bytes));
    }
}
