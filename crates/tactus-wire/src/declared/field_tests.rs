use proptest::prelude::*;

use super::Field;
use crate::declared::Endian;

#[test]
fn golden_bytes() {
    let field = |endian| Field { offset: 1, width: 3, endian };
    let frame = [9, 1, 2, 3, 9];
    assert_eq!(field(Endian::Little).read(&frame), Some(0x03_02_01));
    assert_eq!(field(Endian::Big).read(&frame), Some(0x01_02_03));
    assert_eq!(field(Endian::Big).read(&frame[..3]), None);
}

proptest! {
    #[test]
    fn round_trip(offset in 0..9usize, width in 1..=8usize, big: bool, value: u64) {
        let field = Field { offset, width, endian: if big { Endian::Big } else { Endian::Little } };
        let mut frame = [0xEE; 17];
        field.write(&mut frame, value);
        let low = u128::from(value) % field.values();
        prop_assert_eq!(field.read(&frame).map(u128::from), Some(low));
        prop_assert!(frame[..offset].iter().chain(&frame[offset + width..]).all(|byte| *byte == 0xEE));
    }
}
