use proptest::prelude::*;

use super::Decoder;
use crate::zaber::{Flag, Header, Message};

fn decode(decoder: &mut Decoder, bytes: &[u8]) -> Vec<String> {
    let mut found = Vec::new();
    decoder.push(bytes, |message| found.push(format!("{} {}", message.header().device, message.data())));
    found
}

#[test]
fn a_message_in_parts_is_put_together() {
    let mut decoder = Decoder::default();
    let stream = b"@01 0 05 OK IDLE -- one\\\r\n\
        !02 0 IDLE -- two\r\n#01 0 05 cont 1 three\\\r\n#01 0 05 cont 2 four\r\n";
    assert_eq!(decode(&mut decoder, stream), ["2 two", "1 one three four"]);
    assert_eq!(decoder.dropped(), 0);
}

#[test]
fn parts_that_do_not_belong_are_dropped() {
    let mut decoder = Decoder::default();
    // No beginning, a part that is missing, and a message that never ends.
    let stream = b"#01 0 05 cont 1 a\r\n@01 0 05 OK IDLE -- b\\\r\n#01 0 05 cont 2 c\r\n\
        @01 0 06 OK IDLE -- d\\\r\n@01 0 06 OK IDLE -- e\r\n";
    assert_eq!(decode(&mut decoder, stream), ["1 e"]);
    assert_eq!(decoder.dropped(), 3);
}

#[test]
fn few_messages_wait_for_their_next_part() {
    let mut decoder = Decoder::default();
    for device in 1..=50 {
        assert!(decode(&mut decoder, format!("@{device:02} 0 OK IDLE -- a\\\r\n").as_bytes()).is_empty());
    }
    assert_eq!(decoder.dropped(), 46);
    let endless = "x".repeat(60);
    assert!(decode(&mut decoder, b"@50 0 OK IDLE -- a\\\r\n").is_empty());
    for part in 1..200 {
        decode(&mut decoder, format!("#50 0 cont {part} {endless}\\\r\n").as_bytes());
    }
    assert!(decoder.dropped() > 47);
}

#[test]
fn checksums_can_be_required() {
    let mut decoder = Decoder::default();
    assert_eq!(
        decode(&mut decoder, b"@01 0 OK IDLE -- 0\r\n@01 0 OK IDLE -- 0:8D\r\n@01 0 OK IDLE -- 1:8D\r\n")
            .len(),
        2
    );
    decoder.require_checksums();
    assert_eq!(decode(&mut decoder, b"@01 0 OK IDLE -- 0\r\n@01 0 OK IDLE -- 0:8D\r\n").len(), 1);
    assert_eq!(decoder.dropped(), 2);
}

proptest! {
    #[test]
    fn any_bytes_and_cuts(bytes in prop::collection::vec(any::<u8>(), 0..200), cut: prop::sample::Index) {
        let (head, tail) = bytes.split_at(cut.index(bytes.len() + 1));
        let (mut cut, mut whole) = (Decoder::default(), Decoder::default());
        let mut pieces = decode(&mut cut, head);
        pieces.extend(decode(&mut cut, tail));
        prop_assert_eq!(pieces, decode(&mut whole, &bytes));
        prop_assert_eq!(cut.dropped(), whole.dropped());
    }

    /// Whatever a device says, however long, arrives whole, however it is cut.
    #[test]
    fn long_messages_and_cuts(
        words in prop::collection::vec("[a-z]{1,12}", 1..60),
        with_checksum: bool,
        cut: prop::sample::Index,
    ) {
        let header = Header { device: 7, axis: 1, id: Some(9) };
        let data = words.join(" ");
        prop_assume!(!data.starts_with("cont"));
        let message = Message::Reply { header, accepted: true, busy: false, flag: Flag::NONE, data };
        let bytes = message.encode(with_checksum);
        let (head, tail) = bytes.split_at(cut.index(bytes.len()));
        let (mut decoder, mut found) = (Decoder::default(), Vec::new());
        decoder.push(head, |message| found.push(message));
        decoder.push(tail, |message| found.push(message));
        prop_assert_eq!(found, [message]);
    }
}
