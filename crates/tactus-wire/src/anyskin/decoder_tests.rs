use proptest::prelude::*;

use super::{CONFIRMING_FRAMES, Decoder, DecoderStats};
use crate::anyskin::{DecodedFrame, FRAME_BYTES, Magnetometer};
use crate::pieces::cut;

/// A frame that its number distinguishes from others.
fn frame(number: u8) -> Vec<u8> {
    let mut magnetometers = [Magnetometer { temperature_c: 24.5, field_ut: [12.25, -310.0, 55.5] }; 5];
    magnetometers[2].field_ut[1] = f32::from(number);
    DecodedFrame { magnetometers }.encode()
}

/// A frame whose numbers contain the bytes that end a frame.
fn frame_with_ends(number: u8) -> Vec<u8> {
    let mut bytes = frame(number);
    bytes[8..10].copy_from_slice(b"\r\n");
    bytes[21..23].copy_from_slice(b"\r\n");
    bytes
}

fn frames(numbers: core::ops::Range<u8>) -> Vec<u8> {
    numbers.flat_map(frame).collect()
}

/// The numbers of the frames that come out if the stream arrives in pieces of these lengths, over and over.
fn decode(stream: &[u8], pieces: &[usize]) -> (Vec<f32>, DecoderStats) {
    let mut decoder = Decoder::new();
    let mut numbers = Vec::new();
    for piece in cut(stream, pieces) {
        decoder.push(piece);
        while let Some(frame) = decoder.next_frame() {
            numbers.push(frame.magnetometers[2].field_ut[1]);
        }
        assert!(decoder.bytes.len() - decoder.start < CONFIRMING_FRAMES * FRAME_BYTES);
    }
    (numbers, decoder.stats())
}

#[test]
fn a_clean_stream_gives_every_frame() {
    let (numbers, stats) = decode(&frames(0..9), &[7]);
    assert_eq!(numbers, [0., 1., 2., 3., 4., 5., 6., 7., 8.]);
    assert_eq!(stats, DecoderStats::default());
}

#[test]
fn the_first_whole_frame_is_not_lost_wherever_the_stream_begins() {
    for begin in 1..FRAME_BYTES {
        let stream = [&frame_with_ends(0)[begin..], &frames(1..5)].concat();
        let (numbers, stats) = decode(&stream, &[11]);
        assert_eq!(numbers, [1., 2., 3., 4.], "from byte {begin}");
        assert_eq!(stats, DecoderStats { skipped_bytes: (FRAME_BYTES - begin) as u64, lost_steps: 0 });
    }
}

#[test]
fn ends_that_are_always_in_the_numbers_do_not_mislead() {
    for begin in 0..FRAME_BYTES {
        let all: Vec<u8> = (0..8).flat_map(frame_with_ends).collect();
        let (numbers, _) = decode(&all[begin..], &[100]);
        let first = u8::from(begin > 0);
        let expected: Vec<f32> = (first..8).map(f32::from).collect();
        assert_eq!(numbers, expected, "from byte {begin}");
    }
}

#[test]
fn in_step_a_frame_is_given_with_its_last_byte() {
    let mut decoder = Decoder::new();
    decoder.push(&frames(0..3));
    assert_eq!(core::iter::from_fn(|| decoder.next_frame()).count(), 3);
    let next = frame(3);
    decoder.push(&next[..FRAME_BYTES - 1]);
    assert_eq!(decoder.next_frame(), None);
    decoder.push(&next[FRAME_BYTES - 1..]);
    assert!(decoder.next_frame().is_some());
}

#[test]
fn a_lost_byte_costs_one_frame_and_is_told() {
    for lost in 0..FRAME_BYTES {
        let mut damaged = frame(3);
        damaged.remove(lost);
        let (numbers, stats) = decode(&[frames(0..3), damaged, frames(4..8)].concat(), &[50]);
        assert_eq!(numbers, [0., 1., 2., 4., 5., 6., 7.], "byte {lost} lost");
        assert_eq!(stats, DecoderStats { skipped_bytes: 81, lost_steps: 1 });
    }
}

#[test]
fn a_dead_magnetometer_is_no_reason_to_lose_step() {
    let mut dead = frame(0);
    dead[16..32].copy_from_slice(&f32::NAN.to_le_bytes().repeat(4));
    assert_eq!(decode(&dead.repeat(4), &[9]).0.len(), 4);
}

proptest! {
    #[test]
    fn cuts_never_matter(
        pieces in prop::collection::vec(
            prop_oneof![
                3 => (0..200u8).prop_map(frame),
                1 => (0..200u8).prop_map(frame_with_ends),
                1 => prop::collection::vec(prop_oneof![Just(0x0D), Just(0x0A), any::<u8>()], 0..100),
            ],
            0..12,
        ),
        cuts in prop::collection::vec(1..200usize, 1..20),
    ) {
        let stream = pieces.concat();
        let whole = decode(&stream, &[stream.len().max(1)]);
        prop_assert_eq!(&decode(&stream, &cuts), &whole);
        prop_assert_eq!(&decode(&stream, &[1]), &whole);
    }

    #[test]
    fn frames_after_anything_are_found(garbage: Vec<u8>) {
        let (numbers, _) = decode(&[garbage, frames(1..5)].concat(), &[30]);
        prop_assert!(numbers.ends_with(&[1., 2., 3., 4.]));
    }
}
