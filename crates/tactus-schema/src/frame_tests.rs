use prost::Message as _;

use super::*;

#[test]
fn a_frame_is_encoded_as_its_message() {
    let empty = Frame {
        seq: 0,
        epoch: 0,
        device_tick: None,
        received: TimeStamp { mono: MonoTime::default(), wall: WallTime::default() },
        counts: Arc::default(),
        flags: FrameFlags::default(),
        lost_before: 0,
        simulated: false,
        bad_elements: Arc::default(),
        temperature_c: None,
    };
    let full = Frame {
        seq: u64::MAX,
        epoch: 3,
        device_tick: Some(DeviceTick(0)),
        received: TimeStamp { mono: MonoTime::from_ns(-1), wall: WallTime::from_ns(1 << 40) },
        counts: [0.0, 100.25, f32::MAX].into(),
        flags: FrameFlags::GAP_BEFORE.with(FrameFlags::BAD_ELEMENTS),
        lost_before: 300,
        simulated: true,
        bad_elements: [0, 1, 4_000].into(),
        temperature_c: Some(0.0),
    };
    for frame in [empty, full] {
        let mut bytes = Vec::new();
        frame.encode(&mut bytes);
        assert_eq!(bytes, pb::Frame::from(&frame).encode_to_vec());
        assert_eq!(Frame::from(pb::Frame::decode(&bytes[..]).unwrap()), frame);
    }
}
