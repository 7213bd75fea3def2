use proptest::prelude::*;

use super::{ElementReading, Reply, ReplyError, Via};
use crate::singletact::Decoder;

/// Laid out by hand after the published sketch: 300 counts, reading 0x1234, at 0x01020304 ticks.
const READING: [u8; 22] = [
    0xFF, 0xFF, 0xFF, 0xFF, 4, 0, 0x2A, 0x01, 0x02, 0x03, 0x04, 6, 0x12, 0x34, 0, 0, 0x01, 0x2C, 0xFE, 0xFE,
    0xFE, 0xFE,
];

fn reading() -> Reply<'static> {
    Reply {
        via: Via::Arduino,
        address: 4,
        timed_out: false,
        id: 0x2A,
        timestamp_ticks: 0x0102_0304,
        data: &READING[12..18],
    }
}

#[test]
fn golden_bytes() {
    assert_eq!(reading().encode(), READING);
    let mut decoder = Decoder::new();
    decoder.push(&READING);
    let reply = decoder.next_reply().unwrap();
    assert_eq!(reply, reading());
    assert_eq!(reply.reading(), Ok(ElementReading { counter: 0x1234, counts: 300 }));
    assert_eq!(reply.reading().unwrap().encode(), READING[12..18]);
}

#[test]
fn the_usb_board_has_another_header() {
    let mut bytes = READING;
    bytes[..4].fill(0xAA);
    let reply = Reply { via: Via::Usb, ..reading() };
    assert_eq!(reply.encode(), bytes);
    let mut decoder = Decoder::new();
    decoder.push(&bytes);
    assert_eq!(decoder.next_reply(), Some(reply));
}

#[test]
fn what_is_no_reading_is_named() {
    let written = Reply { data: &[], ..reading() };
    assert_eq!(written.encode().len(), 16);
    assert_eq!(written.reading(), Err(ReplyError::Length { bytes: 0 }));
    let silent = Reply { timed_out: true, ..reading() };
    assert_eq!(silent.reading(), Err(ReplyError::TimedOut { address: 4 }));
}

#[test]
#[should_panic(expected = "a reply of 33 bytes")]
fn too_long() {
    Reply { data: &[0; 33], ..reading() }.encode();
}

proptest! {
    #[test]
    fn round_trip(
        usb: bool,
        address in 0..0x80u8,
        timed_out: bool,
        id: u8,
        timestamp_ticks: u32,
        data in prop::collection::vec(any::<u8>(), 0..=32),
    ) {
        let via = if usb { Via::Usb } else { Via::Arduino };
        let reply = Reply { via, address, timed_out, id, timestamp_ticks, data: &data };
        let mut decoder = Decoder::new();
        decoder.push(&reply.encode());
        prop_assert_eq!(decoder.next_reply(), Some(reply));
        prop_assert_eq!(decoder.stats().skipped_bytes, 0);
    }
}
