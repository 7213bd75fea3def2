use std::sync::Arc;

use proptest::prelude::*;

use super::{Decoder, DecoderStats};
use crate::declared::{Encoder, Format, RawFormat};
use crate::pieces::cut;

fn format(text: &str) -> Arc<Format> {
    Arc::new(toml::from_str::<RawFormat>(text).unwrap().check().unwrap())
}

/// 3 x 2 elements, with everything that a frame can have.
const RICH: &str = r#"
    schema = "tactus.link/1"
    name = "rich"
    [frame]
    bytes = 24
    sync = [0xAA, 0x55]
    trailer = [0x0D]
    length = { offset = 2, width = 1, adds = 4 }
    [samples]
    offset = 7
    elements = 6
    rows = 3
    cols = 2
    type = "u16"
    endian = "big"
    order = "column-major"
    bad = [0xFFFF]
    [sequence]
    offset = 3
    width = 1
    [timestamp]
    offset = 4
    width = 3
    tick_ns = 1000000
    unchanged_is_stale = true
    [checksum]
    kind = "crc16"
    polynomial = 0x1021
    init = 0xFFFF
    reflect = false
    xorout = 0
    check = 0x29B1
    from = 2
    endian = "big"
"#;

/// Laid out by hand, the checksum by a separate program: 1 to 5 and a bad element, at tick 0x123456.
const RICH_FRAME: [u8; 24] = [
    0xAA, 0x55, 20, 0, 0x56, 0x34, 0x12, 0x00, 0x01, 0x00, 0x03, 0x00, 0x05, 0x00, 0x02, 0x00, 0x04, 0xFF,
    0xFF, 0, 0, 0x0E, 0x85, 0x0D,
];

/// 4 bytes and a CRC, behind a sync that can overlap itself.
const CLOSED: &str = r#"
    schema = "tactus.link/1"
    name = "closed"
    frame = { bytes = 8, sync = [0xAA, 0xAA] }
    samples = { offset = 2, elements = 4, type = "u8" }
    checksum = { kind = "crc16", polynomial = 0x8005, init = 0xFFFF, reflect = true, xorout = 0 }
"#;

/// Nothing but sync and samples.
const PLAIN: &str = r#"
    schema = "tactus.link/1"
    name = "plain"
    frame = { bytes = 8, sync = [0xAA, 0x55] }
    samples = { offset = 2, elements = 4, type = "u12" }
"#;

fn formats() -> Vec<Arc<Format>> {
    let modbus = "kind = \"crc16\", polynomial = 0x8005, init = 0xFFFF, reflect = true, xorout = 0";
    let wide = CLOSED.replace("bytes = 8", "bytes = 10").replace(modbus, "kind = \"crc32\"");
    vec![format(RICH), format(CLOSED), format(&wide)]
}

/// A frame, owned.
#[derive(Debug, Clone, PartialEq)]
struct Owned {
    at: u64,
    sequence: Option<u64>,
    lost_before: u64,
    tick: Option<u64>,
    stale: bool,
    counts: Vec<f32>,
    bad: Vec<usize>,
}

fn drain(decoder: &mut Decoder) -> Vec<Owned> {
    let mut frames = Vec::new();
    while let Some(frame) = decoder.next_frame() {
        frames.push(Owned {
            at: frame.at,
            sequence: frame.sequence,
            lost_before: frame.lost_before,
            tick: frame.tick,
            stale: frame.stale,
            counts: frame.counts.to_vec(),
            bad: frame.bad.to_vec(),
        });
    }
    frames
}

/// The decoder's output if the stream arrives in pieces of these lengths, repeated.
fn decode(format: &Arc<Format>, stream: &[u8], pieces: &[usize]) -> (Vec<Owned>, DecoderStats) {
    let mut decoder = Decoder::new(Arc::clone(format));
    let mut frames = Vec::new();
    for piece in cut(stream, pieces) {
        decoder.push(piece);
        frames.extend(drain(&mut decoder));
        assert!(decoder.bytes.len() - decoder.start < format.frame_bytes() + format.head.len());
    }
    (frames, decoder.stats())
}

/// Frames with the numbers `0..count`, whose counts tell them apart.
fn frames(format: &Arc<Format>, count: u8) -> Vec<Vec<u8>> {
    let mut encoder = Encoder::new(Arc::clone(format));
    let elements = format.samples().elements();
    (0..count)
        .map(|number| encoder.encode(number.into(), &vec![number.into(); elements]).unwrap().to_vec())
        .collect()
}

fn first_counts(frames: &[Owned]) -> Vec<f32> {
    frames.iter().map(|frame| frame.counts[0]).collect()
}

#[test]
fn golden_bytes() {
    let format = format(RICH);
    let mut encoder = Encoder::new(Arc::clone(&format));
    assert_eq!(encoder.encode(0x12_3456, &[1., 2., 3., 4., 5., 65_535.]).unwrap(), RICH_FRAME);
    let (frames, stats) = decode(&format, &RICH_FRAME, &[5]);
    let expected = Owned {
        at: 0,
        sequence: Some(0),
        lost_before: 0,
        tick: Some(0x12_3456),
        stale: false,
        counts: vec![1., 2., 3., 4., 5., 65_535.],
        bad: vec![5],
    };
    assert_eq!(frames, [expected]);
    assert_eq!(stats, DecoderStats { frames: 1, ..Default::default() });
}

#[test]
fn lost_and_stale_frames_are_told() {
    let format = format(RICH);
    let mut encoder = Encoder::new(Arc::clone(&format));
    let mut stream = Vec::new();
    for tick in [10, 11, 11, 12] {
        stream.extend_from_slice(encoder.encode(tick, &[0.0; 6]).unwrap());
    }
    for _ in 0..254 {
        encoder.lose_frame();
    }
    stream.extend_from_slice(encoder.encode((1 << 24) + 9, &[0.0; 6]).unwrap());
    let (frames, stats) = decode(&format, &stream, &[100]);
    let told: Vec<_> =
        frames.iter().map(|frame| (frame.sequence, frame.lost_before, frame.tick, frame.stale)).collect();
    assert_eq!(
        told[..4],
        [
            (Some(0), 0, Some(10), false),
            (Some(1), 0, Some(11), false),
            (Some(2), 0, Some(11), true),
            (Some(3), 0, Some(12), false),
        ]
    );
    // 254 ahead of 3 is more than half the way round of 256.
    assert_eq!((stats.lost_frames, stats.stale_frames, stats.frames), (0, 1, 5));
    for _ in 0..7 {
        encoder.lose_frame();
    }
    let mut decoder = Decoder::new(format);
    decoder.push(&stream[stream.len() - 24..]);
    decoder.push(encoder.encode(0, &[0.0; 6]).unwrap());
    assert_eq!(drain(&mut decoder)[1].lost_before, 7);
}

#[test]
fn the_first_frame_after_garbage_is_found_when_its_last_byte_arrives() {
    for format in formats() {
        let good = frames(&format, 3);
        let cuts = (0..good[1].len()).map(|end| good[1][..end].to_vec());
        let flips = (0..good[1].len() * 8).map(|bit| {
            let mut flipped = good[1].clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            flipped
        });
        for garbage in cuts.chain(flips).chain([vec![0xAA; 9], vec![0x55; 300], vec![0xAA, 0x55, 20, 0xAA]]) {
            let mut decoder = Decoder::new(Arc::clone(&format));
            decoder.push(&garbage);
            assert_eq!(drain(&mut decoder), []);
            let (last, all_but_last) = good[2].split_last().unwrap();
            decoder.push(all_but_last);
            assert_eq!(drain(&mut decoder), []);
            decoder.push(&[*last]);
            assert_eq!(first_counts(&drain(&mut decoder)), [2.0], "after {garbage:02x?}");
            assert_eq!(decoder.stats().skipped_bytes, garbage.len() as u64);
        }
    }
}

#[test]
fn what_did_not_hold_is_counted() {
    let format = format(RICH);
    let good = frames(&format, 1).remove(0);
    let damaged = |at: usize| {
        let mut frame = good.clone();
        frame[at] ^= 1;
        decode(&format, &frame, &[100]).1
    };
    let nothing = DecoderStats { skipped_bytes: 24, ..Default::default() };
    assert_eq!(damaged(0), nothing);
    assert_eq!(damaged(2), DecoderStats { bad_lengths: 1, ..nothing });
    assert_eq!(damaged(9), DecoderStats { bad_checksums: 1, ..nothing });
    assert_eq!(damaged(23), DecoderStats { bad_ends: 1, ..nothing });
}

#[test]
fn without_a_checksum_a_frame_is_given_with_its_last_byte_too() {
    let format = format(PLAIN);
    let good = frames(&format, 2);
    let mut decoder = Decoder::new(Arc::clone(&format));
    decoder.push(&[0x55, 0xAA, 0x55, 1, 2]);
    decoder.push(&good[1]);
    assert_eq!(first_counts(&drain(&mut decoder)), [1.0]);
    assert_eq!(decoder.stats().skipped_bytes, 5);
}

#[test]
fn without_a_checksum_lost_bytes_do_not_cost_the_next_frame() {
    let format = format(PLAIN);
    let good = frames(&format, 4);
    for lost in 0..8 {
        let mut damaged = good[1].clone();
        damaged.remove(lost);
        let (found, _) =
            decode(&format, &[&good[0], &damaged, &good[2], &good[3]].map(|f| &f[..]).concat(), &[3]);
        assert_eq!(first_counts(&found), [0., 2., 3.], "byte {lost} lost");
    }
}

#[test]
fn without_a_checksum_sync_bytes_in_samples_wait_for_the_next_frame() {
    let format = format(PLAIN);
    let tricky = [0xAA, 0x55, 1, 0xAA, 0x55, 2, 3, 4];
    let mut decoder = Decoder::new(Arc::clone(&format));
    decoder.push(&tricky);
    decoder.push(&[0xAA]);
    assert_eq!(drain(&mut decoder), []);
    decoder.push(&[0x55]);
    assert_eq!(drain(&mut decoder).len(), 1);
    decoder.push(&tricky[2..]);
    decoder.push(&tricky.repeat(3));
    assert_eq!(drain(&mut decoder).len(), 3);
    assert_eq!(decoder.stats().skipped_bytes, 0);
}

const REPORT: &str = r#"
    schema = "tactus.link/1"
    name = "report"
    framing = "packet"
    frame = { bytes = 6, sync = [] }
    hid = { report_id = 3 }
    samples = { offset = 1, elements = 2, type = "u16" }
    checksum = { kind = "sum8" }
"#;

#[test]
fn packets_are_frames_or_nothing() {
    let format = format(REPORT);
    let mut decoder = Decoder::new(Arc::clone(&format));
    let good = frames(&format, 2);
    assert_eq!(good[1], [3, 1, 0, 1, 0, 5]);
    decoder.push(&good[1]);
    assert_eq!(first_counts(&drain(&mut decoder)), [1.0]);
    decoder.push(&[]);
    decoder.push(&good[1][..5]);
    decoder.push(&[9, 1, 0, 1, 0, 11]);
    decoder.push(&[3, 1, 0, 1, 0, 4]);
    assert_eq!(drain(&mut decoder), []);
    decoder.push(&good[1]);
    assert_eq!(drain(&mut decoder)[0].at, 23);
    let stats = decoder.stats();
    assert_eq!((stats.bad_lengths, stats.bad_checksums, stats.skipped_bytes, stats.frames), (1, 1, 17, 2));
}

/// Pieces of a hostile stream for a format: frames, cut ones, sync bytes, noise.
fn stream(format: &Arc<Format>) -> impl Strategy<Value = Vec<u8>> + use<> {
    let good = frames(format, 6);
    let piece = prop_oneof![
        3 => prop::sample::select(good.clone()),
        1 => (prop::sample::select(good), any::<prop::sample::Index>())
            .prop_map(|(frame, cut)| frame[..cut.index(frame.len())].to_vec()),
        1 => prop::collection::vec(prop_oneof![Just(0xAA), Just(0x55), Just(20), any::<u8>()], 0..20),
    ];
    prop::collection::vec(piece, 0..12).prop_map(|pieces| pieces.concat())
}

fn any_format() -> impl Strategy<Value = Arc<Format>> {
    let mut formats = formats();
    formats.push(format(PLAIN));
    formats.push(format(&PLAIN.replace("0xAA, 0x55", "0xAA, 0xAA")));
    prop::sample::select(formats)
}

proptest! {
    #[test]
    fn cuts_never_matter(
        (format, stream) in any_format().prop_flat_map(|format| (Just(Arc::clone(&format)), stream(&format))),
        cuts in prop::collection::vec(1..50usize, 1..20),
    ) {
        let whole = decode(&format, &stream, &[stream.len().max(1)]);
        prop_assert_eq!(&decode(&format, &stream, &cuts), &whole);
        prop_assert_eq!(&decode(&format, &stream, &[1]), &whole);
    }

    #[test]
    fn whole_frames_after_anything_are_found(
        format in prop::sample::select(formats()),
        garbage: Vec<u8>,
    ) {
        let good = frames(&format, 3);
        let (found, _) = decode(&format, &[&garbage[..], &good[1], &good[2]].concat(), &[9]);
        prop_assert!(first_counts(&found).ends_with(&[1.0, 2.0]));
    }

    #[test]
    fn a_clean_stream_gives_every_frame(
        format in prop::sample::select(formats()),
        ticks in prop::collection::vec((any::<u64>(), any::<u8>()), 0..20),
        cuts in prop::collection::vec(1..50usize, 1..20),
    ) {
        let mut encoder = Encoder::new(Arc::clone(&format));
        let elements = format.samples().elements();
        let mut stream = Vec::new();
        for (tick, count) in &ticks {
            stream.extend_from_slice(encoder.encode(*tick, &vec![f32::from(*count); elements]).unwrap());
        }
        let (found, stats) = decode(&format, &stream, &cuts);
        let counts: Vec<f32> = ticks.iter().map(|(_, count)| f32::from(*count)).collect();
        prop_assert_eq!(first_counts(&found), counts);
        prop_assert_eq!(stats.skipped_bytes + stats.bad_checksums + stats.bad_lengths + stats.lost_frames, 0);
    }
}
