use proptest::prelude::*;

use super::{Algorithm, CRC32, Crc, CrcParameters, CrcWidth};

const DIGITS: &[u8] = b"123456789";

fn crc16(polynomial: u32, init: u32, reflect: bool, xorout: u32) -> Crc {
    Crc::new(CrcParameters { width: CrcWidth::Bits16, polynomial, init, reflect, xorout })
}

/// The check values of the public catalogue of CRC algorithms.
#[test]
fn check_values() {
    let checks = [
        ("XMODEM", crc16(0x1021, 0, false, 0), 0x31C3),
        ("CCITT-FALSE", crc16(0x1021, 0xFFFF, false, 0), 0x29B1),
        ("KERMIT", crc16(0x1021, 0, true, 0), 0x2189),
        ("X-25", crc16(0x1021, 0xFFFF, true, 0xFFFF), 0x906E),
        ("RIELLO, whose init is not symmetric", crc16(0x1021, 0xB2AA, true, 0), 0x63D0),
        ("ARC", crc16(0x8005, 0, true, 0), 0xBB3D),
        ("MODBUS", crc16(0x8005, 0xFFFF, true, 0), 0x4B37),
        ("CRC-32", Crc::new(CRC32), 0xCBF4_3926),
        ("CRC-32/BZIP2", Crc::new(CrcParameters { reflect: false, ..CRC32 }), 0xFC89_1918),
        ("CRC-32C", Crc::new(CrcParameters { polynomial: 0x1EDC_6F41, ..CRC32 }), 0xE306_9283),
    ];
    for (name, crc, check) in checks {
        assert_eq!(crc.of(DIGITS), check, "{name}");
    }
    assert_eq!(Algorithm::Sum8.of(DIGITS), 0xDD);
    assert_eq!(Algorithm::Xor8.of(DIGITS), 0x31);
}

/// The definition, bit by bit.
fn slow(parameters: CrcParameters, bytes: &[u8]) -> u32 {
    let CrcParameters { width, polynomial, init, reflect, xorout } = parameters;
    let bits = if width == CrcWidth::Bits16 { 16 } else { 32 };
    let mut crc = u64::from(init);
    for byte in bytes {
        let byte = if reflect { byte.reverse_bits() } else { *byte };
        crc ^= u64::from(byte) << (bits - 8);
        for _ in 0..8 {
            crc <<= 1;
            if crc >> bits & 1 == 1 {
                crc ^= 1 << bits | u64::from(polynomial);
            }
        }
    }
    let crc = u32::try_from(crc).unwrap();
    (if reflect { crc.reverse_bits() >> (32 - bits) } else { crc }) ^ xorout
}

proptest! {
    #[test]
    fn tables_agree_with_the_definition(
        wide: bool,
        polynomial: u32,
        init: u32,
        reflect: bool,
        xorout: u32,
        bytes: Vec<u8>,
    ) {
        let width = if wide { CrcWidth::Bits32 } else { CrcWidth::Bits16 };
        let fit = |number: u32| if wide { number } else { number & 0xFFFF };
        let parameters =
            CrcParameters { width, polynomial: fit(polynomial), init: fit(init), reflect, xorout: fit(xorout) };
        prop_assert_eq!(Crc::new(parameters).of(&bytes), slow(parameters, &bytes));
    }
}
