use proptest::prelude::*;

use super::Checksum;
use crate::weiss::{ChecksumError, Decoder, acquire, encode_packet, query_controller, query_matrix};

/// Laid out by hand: the last byte is the sum of all behind the sync bytes.
#[test]
fn golden_bytes() {
    assert_eq!(Checksum::Sum8.close(query_controller()), [0xAA, 0xAA, 0xAA, 0x01, 0x00, 0x00]);
    assert_eq!(Checksum::Sum8.close(query_matrix(2)), [0xAA, 0xAA, 0xAA, 0x0B, 0x01, 0x00, 0x02, 0x0E]);
    assert_eq!(
        Checksum::Sum8.close(acquire(true, false, 260)),
        [0xAA, 0xAA, 0xAA, 0x03, 0x03, 0x00, 0x80, 0x04, 0x01, 0x8B]
    );
    assert_eq!(Checksum::Crc.close(query_matrix(2)), query_matrix(2));
}

#[test]
fn a_wrong_sum_is_told() {
    let mut packet = Checksum::Sum8.close(encode_packet(7, &[1, 2, 3]));
    *packet.last_mut().unwrap() ^= 1;
    let mut decoder = Decoder::new().with_checksum(Checksum::Sum8);
    decoder.push(&packet);
    assert_eq!(
        decoder.next_packet(),
        Some(Err(ChecksumError { id: 7, bytes: 3, expected: 0x10, found: 0x11 }))
    );
}

#[test]
fn each_form_is_no_packet_in_the_other() {
    let packet = encode_packet(7, &[1, 2, 3]);
    let mut decoder = Decoder::new().with_checksum(Checksum::Sum8);
    decoder.push(&packet);
    assert!(decoder.next_packet().is_some_and(|packet| packet.is_err()));
    let mut decoder = Decoder::new();
    decoder.push(&Checksum::Sum8.close(packet).repeat(2));
    assert!(decoder.next_packet().is_some_and(|packet| packet.is_err()));
}

#[test]
fn the_first_packet_after_garbage_is_found_when_its_last_byte_arrives() {
    let packet = Checksum::Sum8.close(encode_packet(0, &[9; 20]));
    for cut in 0..packet.len() {
        let mut decoder = Decoder::new().with_checksum(Checksum::Sum8);
        decoder.push(&packet[..cut]);
        decoder.push(&packet[..packet.len() - 1]);
        assert!(decoder.next_packet().is_none_or(|packet| packet.is_err()));
        decoder.push(&packet[packet.len() - 1..]);
        let found =
            core::iter::from_fn(|| decoder.next_packet().map(|packet| packet.is_ok())).any(|good| good);
        assert!(found, "cut at {cut}");
    }
}

proptest! {
    #[test]
    fn round_trip(
        packets in prop::collection::vec((1..0x20u8, prop::collection::vec(any::<u8>(), 0..60)), 0..20),
        cut: prop::sample::Index,
    ) {
        // Three sync bytes within a payload may begin a packet whose sum holds by chance.
        let has_sync = |payload: &[u8]| payload.windows(2).any(|two| two == [0xAA; 2]);
        prop_assume!(!packets.iter().any(|(_, payload)| has_sync(payload)));
        let stream: Vec<u8> = packets
            .iter()
            .flat_map(|(id, payload)| Checksum::Sum8.close(encode_packet(*id, payload)))
            .collect();
        let mut decoder = Decoder::new().with_checksum(Checksum::Sum8);
        let mut found = Vec::new();
        let (head, tail) = stream.split_at(cut.index(stream.len() + 1));
        for piece in [head, tail] {
            decoder.push(piece);
            while let Some(packet) = decoder.next_packet() {
                let packet = packet.unwrap();
                found.push((packet.id, packet.payload.to_vec()));
            }
        }
        prop_assert_eq!(found, packets);
        prop_assert_eq!(decoder.stats().skipped_bytes, 0);
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes: Vec<u8>) {
        let mut decoder = Decoder::new().with_checksum(Checksum::Sum8);
        decoder.push(&bytes);
        while decoder.next_packet().is_some() {}
    }
}
