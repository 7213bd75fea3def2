use proptest::prelude::*;

use super::{ChecksumError, Decoder, DecoderStats};
use crate::pieces::cut;
use crate::weiss::{acquire, crc, encode_frame, encode_packet, query_sensor};

/// A packet or the fault that took its place, owned.
type Owned = Result<(u8, Vec<u8>), ChecksumError>;

fn drain(decoder: &mut Decoder) -> Vec<Owned> {
    let mut packets = Vec::new();
    while let Some(packet) = decoder.next_packet() {
        packets.push(packet.map(|packet| (packet.id, packet.payload.to_vec())));
    }
    packets
}

/// The decoder's output if the stream arrives in pieces of these lengths, repeated.
fn decode(stream: &[u8], pieces: &[usize]) -> (Vec<Owned>, DecoderStats) {
    let mut decoder = Decoder::new();
    let mut packets = Vec::new();
    for piece in cut(stream, pieces) {
        decoder.push(piece);
        packets.extend(drain(&mut decoder));
    }
    (packets, decoder.stats())
}

fn good(packets: &[Owned]) -> Vec<(u8, Vec<u8>)> {
    packets.iter().filter_map(|packet| packet.clone().ok()).collect()
}

fn frame(timestamp_ms: u32) -> Vec<u8> {
    encode_frame(timestamp_ms, &[0x0AAA, 3, 0x0AAA, 4], false)
}

fn payload(packet: &[u8]) -> (u8, Vec<u8>) {
    (packet[3], packet[6..packet.len() - 2].to_vec())
}

#[test]
fn every_cut_gives_the_same() {
    let stream =
        [&b"garbage\xAA\xAA"[..], &frame(1), &query_sensor(), &frame(2), b"\xAA\xAA\xAA\xAA"].concat();
    let whole = decode(&stream, &[stream.len()]);
    assert_eq!(good(&whole.0), [payload(&frame(1)), (2, vec![]), payload(&frame(2))]);
    for cut in 1..stream.len() {
        assert_eq!(decode(&stream, &[cut, stream.len()]), whole, "cut at {cut}");
    }
    assert_eq!(decode(&stream, &[1]), whole);
}

#[test]
fn the_first_frame_after_garbage_is_found_when_its_last_byte_arrives() {
    // What may stand before a frame: noise, cut frames, sync bytes with any length behind them.
    let cut = frame(1);
    let mut broken_length = frame(1);
    broken_length[5] ^= 0x02;
    let all_lengths = (0..=u8::MAX).map(|high| vec![0xAA, 0xAA, 0xAA, 0x00, 0x10, high]);
    let garbage = (0..cut.len()).map(|end| cut[..end].to_vec()).chain(all_lengths).chain([
        vec![0xAA; 7],
        vec![0x55; 1000],
        broken_length,
        b"\x1b[5n".repeat(3),
    ]);
    for garbage in garbage {
        let mut decoder = Decoder::new();
        decoder.push(&garbage);
        drain(&mut decoder);
        let next = frame(2);
        let (last, all_but_last) = next.split_last().unwrap();
        decoder.push(all_but_last);
        assert!(!good(&drain(&mut decoder)).contains(&payload(&next)));
        decoder.push(&[*last]);
        assert!(good(&drain(&mut decoder)).contains(&payload(&next)), "after {garbage:02x?}");
    }
}

#[test]
fn a_flipped_bit_costs_one_packet() {
    let clean = frame(1);
    for bit in 0..clean.len() * 8 {
        let mut flipped = clean.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let (packets, stats) = decode(&[frame(0), flipped, frame(2)].concat(), &[7]);
        assert_eq!(good(&packets), [payload(&frame(0)), payload(&frame(2))], "bit {bit}");
        assert!(stats.bad_checksums + stats.skipped_bytes > 0);
    }
}

#[test]
fn a_lost_byte_costs_one_packet() {
    // Less than 256 bytes, and a tick that begins with a 0: without the low byte of its length the frame seems to be empty.
    let clean = encode_frame(0, &[1; 120], false);
    assert_eq!(clean[4..6], [245, 0]);
    for lost in 0..clean.len() {
        let damaged = [&clean[..lost], &clean[lost + 1..]].concat();
        let (packets, stats) = decode(&[frame(0), damaged, frame(2), frame(3)].concat(), &[7]);
        // Without its id it is an empty packet of another kind, of no use and no harm.
        let frames: Vec<_> = good(&packets).into_iter().filter(|(id, _)| *id == 0).collect();
        assert_eq!(frames, [payload(&frame(0)), payload(&frame(2)), payload(&frame(3))], "byte {lost}");
        assert!(stats.bad_checksums + stats.skipped_bytes > 0);
    }
}

#[test]
fn a_frame_without_a_payload_is_garbage() {
    let (packets, stats) = decode(&[encode_packet(0, &[]), frame(2)].concat(), &[1]);
    assert_eq!(packets, [Ok(payload(&frame(2)))]);
    assert_eq!(stats, DecoderStats { skipped_bytes: 6, bad_checksums: 1, boot_messages: 0 });
}

#[test]
fn a_wrong_checksum_is_told() {
    let mut packet = encode_packet(7, &[1, 2, 3]);
    let found = u16::from_le_bytes([packet[9], packet[10]]) ^ 0x0100;
    packet[10] ^= 0x01;
    let (packets, stats) = decode(&packet, &[100]);
    let expected = crc(&[7, 3, 0, 1, 2, 3]);
    assert_eq!(packets, [Err(ChecksumError { id: 7, bytes: 3, expected, found })]);
    assert_eq!(stats, DecoderStats { skipped_bytes: 11, bad_checksums: 1, boot_messages: 0 });
}

#[test]
fn sync_bytes_within_a_payload_are_no_packet() {
    let packet = encode_packet(7, &[0xAA, 0xAA, 0xAA, 0x00, 0x02, 0x00, 0xAA, 0xAA, 0xAA, 0xAA]);
    let (packets, stats) = decode(&packet.repeat(3), &[1]);
    assert_eq!(good(&packets).len(), 3);
    assert_eq!(stats, DecoderStats::default());
}

#[test]
fn boot_messages_are_counted() {
    let stream = [b"\x1b[5n\x1b[\x1b[5n".to_vec(), frame(1), b"[5n\x1b[5".to_vec(), frame(2), b"n".to_vec()];
    let stats = decode(&stream.concat(), &[3]).1;
    assert_eq!(stats.boot_messages, 2);
}

#[test]
fn payloads_are_bounded() {
    let mut decoder = Decoder::with_max_payload(4);
    decoder.push(&encode_packet(1, &[0; 4]));
    decoder.push(&encode_packet(1, &[0; 5]));
    decoder.push(&acquire(true, true, 30));
    assert_eq!(good(&drain(&mut decoder)), [(1, vec![0; 4]), (3, vec![0x81, 30, 0])]);
}

/// Pieces of a hostile stream: good packets, packets around packets, sync bytes, noise.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let packet =
        (0..0x20u8, prop::collection::vec(any::<u8>(), 0..40)).prop_map(|(id, p)| encode_packet(id, &p));
    let nested =
        packet.clone().prop_map(|inner| encode_packet(5, &[&[0xAA; 2], &inner[..], &[0; 3]].concat()));
    let cut = (packet.clone(), any::<prop::sample::Index>())
        .prop_map(|(packet, cut)| packet[..cut.index(packet.len())].to_vec());
    prop_oneof![
        3 => packet,
        1 => nested,
        1 => cut,
        1 => prop::collection::vec(prop_oneof![Just(0xAA), Just(0x00), any::<u8>()], 0..20),
    ]
}

proptest! {
    #[test]
    fn cuts_never_matter(
        pieces in prop::collection::vec(piece(), 0..12),
        cuts in prop::collection::vec(1..50usize, 1..20),
    ) {
        let stream = pieces.concat();
        let whole = decode(&stream, &[stream.len()]);
        prop_assert_eq!(&decode(&stream, &cuts), &whole);
        prop_assert_eq!(&decode(&stream, &[1]), &whole);
    }

    #[test]
    fn a_clean_stream_gives_every_packet(
        packets in prop::collection::vec((1..0x20u8, prop::collection::vec(any::<u8>(), 0..60)), 0..20),
        cuts in prop::collection::vec(1..50usize, 1..20),
    ) {
        let stream: Vec<u8> = packets.iter().flat_map(|(id, payload)| encode_packet(*id, payload)).collect();
        let (found, stats) = decode(&stream, &cuts);
        prop_assert_eq!(good(&found), packets);
        prop_assert_eq!(stats, DecoderStats::default());
    }
}
