use proptest::prelude::*;

use super::{DecodedFrame, FrameError, encode_frame};
use crate::weiss::{Decoder, Packet};

/// Laid out by hand from the published format, checksums by a separate program.
const PLAIN: [u8; 21] = [
    0xAA, 0xAA, 0xAA, 0x00, 0x0D, 0x00, 0x78, 0x56, 0x34, 0x12, 0x00, 0x64, 0x00, 0x64, 0x00, 0xFF, 0x0F,
    0x00, 0x00, 0xDF, 0x70,
];

/// The same reading: twice 100, once 4095, once 0.
const RUN_LENGTH: [u8; 19] = [
    0xAA, 0xAA, 0xAA, 0x00, 0x0B, 0x00, 0x78, 0x56, 0x34, 0x12, 0x01, 0x64, 0x20, 0xFF, 0x1F, 0x00, 0x10,
    0x7E, 0xF7,
];

const COUNTS: [u16; 4] = [100, 100, 4095, 0];

fn read(bytes: &[u8], elements: usize) -> Result<DecodedFrame, FrameError> {
    let mut decoder = Decoder::with_max_payload(65_535);
    decoder.push(bytes);
    DecodedFrame::parse(&decoder.next_packet().unwrap().unwrap(), elements)
}

#[test]
fn golden_bytes() {
    assert_eq!(encode_frame(0x1234_5678, &COUNTS, false), PLAIN);
    assert_eq!(encode_frame(0x1234_5678, &COUNTS, true), RUN_LENGTH);
}

#[test]
fn both_forms_read_the_same() {
    let plain = read(&PLAIN, 4).unwrap();
    assert_eq!(plain, DecodedFrame { timestamp_ms: 0x1234_5678, run_length: false, counts: COUNTS.to_vec() });
    assert_eq!(read(&RUN_LENGTH, 4).unwrap(), DecodedFrame { run_length: true, ..plain });
}

#[test]
fn a_run_of_twenty_takes_two_words() {
    let golden = [
        0xAA, 0xAA, 0xAA, 0x00, 0x09, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x0A, 0xF0, 0x0A, 0x50, 0x68, 0xA1,
    ];
    assert_eq!(encode_frame(1, &[10; 20], true), golden);
    assert_eq!(read(&golden, 20).unwrap().counts, [10; 20]);
}

#[test]
fn run_length_words_hold_twelve_bits() {
    assert_eq!(read(&encode_frame(0, &[5000, 4096], true), 2).unwrap().counts, [4095, 4095]);
}

#[test]
fn a_wrong_array_is_named_with_both_numbers() {
    let error = read(&PLAIN, 48).unwrap_err();
    assert_eq!(error, FrameError::Elements { expected: 48, found: 4 });
    assert_eq!(error.to_string(), "the frame has 4 elements, the rig's array has 48");
    assert_eq!(read(&RUN_LENGTH, 3), Err(FrameError::Elements { expected: 3, found: 4 }));
}

#[test]
fn broken_payloads_are_named() {
    let parse = |payload: &[u8]| DecodedFrame::parse(&Packet { id: 0, payload }, 1);
    assert_eq!(parse(&[]), Err(FrameError::Length { bytes: 0 }));
    assert_eq!(parse(&[0; 4]), Err(FrameError::Length { bytes: 4 }));
    assert_eq!(parse(&[0; 6]), Err(FrameError::Length { bytes: 6 }));
    assert_eq!(parse(&[0; 5]), Err(FrameError::Elements { expected: 1, found: 0 }));
    assert_eq!(
        DecodedFrame::parse(&Packet { id: 9, payload: &[0; 7] }, 1),
        Err(FrameError::NotAFrame { id: 9 })
    );
}

proptest! {
    #[test]
    fn round_trip(
        timestamp_ms: u32,
        counts in prop::collection::vec(prop_oneof![Just(100u16), 0..4096u16], 0..200),
        run_length: bool,
    ) {
        let frame = read(&encode_frame(timestamp_ms, &counts, run_length), counts.len()).unwrap();
        prop_assert_eq!(frame, DecodedFrame { timestamp_ms, run_length, counts });
    }

    #[test]
    fn any_payload_is_read_or_refused(payload: Vec<u8>, elements in 0..100usize) {
        if let Ok(frame) = DecodedFrame::parse(&Packet { id: 0, payload: &payload }, elements) {
            prop_assert_eq!(frame.counts.len(), elements);
        }
    }
}
