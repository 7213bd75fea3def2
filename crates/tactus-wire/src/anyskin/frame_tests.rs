use proptest::prelude::*;

use super::{DecodedFrame, FRAME_BYTES, Magnetometer};

/// Laid out by hand: 25 degrees, 1, -2 and 0.5 microtesla, five times.
#[test]
fn golden_bytes() {
    let one = [0, 0, 0xC8, 0x41, 0, 0, 0x80, 0x3F, 0, 0, 0, 0xC0, 0, 0, 0, 0x3F];
    let golden = [&one.repeat(5)[..], b"\r\n"].concat();
    let frame =
        DecodedFrame { magnetometers: [Magnetometer { temperature_c: 25.0, field_ut: [1.0, -2.0, 0.5] }; 5] };
    assert_eq!(golden.len(), 82);
    assert_eq!(frame.encode(), golden);
    assert_eq!(DecodedFrame::parse(golden[..].try_into().unwrap()), Some(frame));
}

#[test]
fn another_end_is_no_frame() {
    assert_eq!(DecodedFrame::parse(&[0; FRAME_BYTES]), None);
}

proptest! {
    #[test]
    fn round_trip(numbers: [[f32; 4]; 5]) {
        let magnetometer = |[t, x, y, z]: [f32; 4]| Magnetometer { temperature_c: t, field_ut: [x, y, z] };
        let frame = DecodedFrame { magnetometers: numbers.map(magnetometer) };
        let bytes = frame.encode();
        // Bytes are compared: NaN is not itself.
        prop_assert_eq!(DecodedFrame::parse(bytes[..].try_into().unwrap()).unwrap().encode(), bytes);
    }
}
