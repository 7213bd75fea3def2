use proptest::prelude::*;

use super::Decoder;
use crate::pieces::cut;
use crate::singletact::{ElementReading, Operation, Reply, Request, Via};

fn reply(id: u8) -> Vec<u8> {
    let data = ElementReading { counter: 0xFFFF, counts: 0xFE01 }.encode();
    let via = if id.is_multiple_of(2) { Via::Arduino } else { Via::Usb };
    Reply { via, address: 4, timed_out: false, id, timestamp_ticks: 0xFFFF_FFFF, data: &data }.encode()
}

/// The ids that come out if the stream arrives in pieces of these lengths, over and over; and the bytes
/// skipped.
fn decode(stream: &[u8], pieces: &[usize], requests: bool) -> (Vec<u8>, u64) {
    let mut decoder = Decoder::new();
    let mut ids = Vec::new();
    for piece in cut(stream, pieces) {
        decoder.push(piece);
        if requests {
            while let Some(request) = decoder.next_request() {
                ids.push(request.id);
            }
        } else {
            while let Some(reply) = decoder.next_reply() {
                ids.push(reply.id);
            }
        }
    }
    (ids, decoder.stats().skipped_bytes)
}

#[test]
fn the_first_reply_after_garbage_is_found_when_its_last_byte_arrives() {
    let cut = reply(1);
    let headers = (0..=u8::MAX).map(|n| vec![0xFF, 0xFF, 0xFF, 0xFF, 4, 0, 0, 0, 0, 0, 0, n]);
    let garbage = (0..cut.len()).map(|end| cut[..end].to_vec()).chain(headers).chain([
        vec![0xFF; 7],
        vec![0xAA; 9],
        vec![0xFE; 9],
        vec![0x55; 1000],
        vec![0xFF, 0xFF, 0xFF, 0xAA, 0xAA, 0xAA],
    ]);
    for garbage in garbage {
        let mut decoder = Decoder::new();
        decoder.push(&garbage);
        assert_eq!(decoder.next_reply(), None);
        let next = reply(2);
        let (last, all_but_last) = next.split_last().unwrap();
        decoder.push(all_but_last);
        assert_eq!(decoder.next_reply(), None);
        decoder.push(&[*last]);
        assert_eq!(decoder.next_reply().map(|reply| reply.id), Some(2), "after {garbage:02x?}");
    }
}

#[test]
fn a_lost_byte_costs_one_reply() {
    for lost in 0..reply(0).len() {
        let mut damaged = reply(2);
        damaged.remove(lost);
        let stream = [reply(1), damaged, reply(3), reply(4)].concat();
        let (ids, skipped) = decode(&stream, &[5], false);
        assert_eq!(ids, [1, 3, 4], "byte {lost} lost");
        assert_eq!(skipped, 21);
    }
}

#[test]
fn memory_is_bounded() {
    let mut decoder = Decoder::new();
    for _ in 0..1000 {
        decoder.push(&[0xFF; 100]);
        assert_eq!(decoder.next_reply(), None);
        assert!(decoder.bytes.len() < 200);
    }
}

/// Pieces of a hostile stream: packets of both directions, cut ones, header and footer bytes, noise.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let request = (0..0x80u8, any::<u8>(), prop::collection::vec(any::<u8>(), 1..=28)).prop_map(
        |(address, id, data)| {
            Request { address, id, operation: Operation::Write { location: 0, data: &data } }
                .encode()
                .unwrap()
        },
    );
    let read = any::<u8>().prop_map(|id| Request::reading(4, id).encode().unwrap());
    let packet = prop_oneof![any::<u8>().prop_map(reply), request, read];
    let cut = (packet.clone(), any::<prop::sample::Index>())
        .prop_map(|(packet, cut)| packet[..cut.index(packet.len())].to_vec());
    prop_oneof![
        3 => packet,
        1 => cut,
        1 => prop::collection::vec(prop_oneof![Just(0xFF), Just(0xFE), Just(0xAA), any::<u8>()], 0..20),
    ]
}

proptest! {
    #[test]
    fn cuts_never_matter(
        pieces in prop::collection::vec(piece(), 0..12),
        cuts in prop::collection::vec(1..50usize, 1..20),
        requests: bool,
    ) {
        let stream = pieces.concat();
        let whole = decode(&stream, &[stream.len().max(1)], requests);
        prop_assert_eq!(&decode(&stream, &cuts, requests), &whole);
        prop_assert_eq!(&decode(&stream, &[1], requests), &whole);
    }

    #[test]
    fn a_whole_reply_after_anything_is_found(garbage: Vec<u8>, id: u8) {
        let (ids, _) = decode(&[garbage, reply(id)].concat(), &[3], false);
        prop_assert_eq!(ids.last(), Some(&id));
    }
}
