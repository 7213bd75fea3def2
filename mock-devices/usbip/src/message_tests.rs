use super::*;
use crate::setup::RequestKind;

/// A request as the kernel sends it: the words before the setup data, that, and data behind.
fn request(words: [u32; 10], setup: [u8; 8], data: &[u8]) -> Vec<u8> {
    let words = words.into_iter().flat_map(u32::to_be_bytes);
    words.chain(setup).chain(data.iter().copied()).collect()
}

/// The answers' words before the padding, and what follows them.
fn words(bytes: &[u8]) -> (Vec<i32>, &[u8]) {
    let (header, data) = bytes.split_at(48);
    let (words, _) = header.as_chunks::<4>();
    (words.iter().map(|word| i32::from_be_bytes(*word)).collect(), data)
}

#[test]
fn a_question_for_the_device_descriptor() {
    // The document's example of a submission: sequence number 0x0D05, to the host, endpoint 0, 0x40 bytes.
    let bytes = request(
        [1, 0x0D05, 0x0001_000F, 1, 0, 0x200, 0x40, 0xFFFF_FFFF, 0, 4],
        [0x80, 6, 0, 1, 0, 0, 0x40, 0],
        &[],
    );
    let mut decoder = Decoder::default();
    decoder.push(&bytes);
    let Ok(Some(UsbipRequest::Submit(transfer))) = decoder.next_request() else { panic!("a transfer") };
    assert_eq!((transfer.seq, transfer.endpoint, &transfer.flow), (0x0D05, 0, &Direction::In(0x40)));
    assert_eq!((transfer.setup.kind(), transfer.setup.descriptor()), (Some(RequestKind::Standard), (1, 0)));
    assert_eq!(decoder.next_request(), Ok(None));
}

#[test]
fn requests_come_in_pieces_and_several_at_once() {
    let out = request([1, 7, 0, 0, 2, 0, 3, 0, 0, 0], [0; 8], b"abc");
    let unlink = request([2, 8, 0, 0, 0, 7, 0, 0, 0, 0], [0; 8], &[]);
    let bytes = [out, unlink].concat();
    for cut in 0..=bytes.len() {
        let mut decoder = Decoder::default();
        let mut found = Vec::new();
        for piece in [&bytes[..cut], &bytes[cut..]] {
            decoder.push(piece);
            while let Some(request) = decoder.next_request().unwrap() {
                found.push(request);
            }
        }
        let [UsbipRequest::Submit(transfer), UsbipRequest::Unlink { seq: 8, victim: 7 }] = &found[..] else {
            panic!("cut at {cut}: {found:?}")
        };
        assert_eq!((transfer.endpoint, &transfer.flow), (2, &Direction::Out(b"abc".to_vec())));
    }
}

#[test]
fn what_is_no_request_is_refused() {
    for (words, error) in [
        ([9, 1, 0, 0, 0, 0, 0, 0, 0, 0], MessageError::Kind(9)),
        ([1, 1, 0, 0, 1, 0, 0x10_0001, 0, 0, 0], MessageError::Length(0x10_0001)),
        ([1, 1, 0, 1, 16, 0, 0, 0, 0, 0], MessageError::Endpoint { endpoint: 16, direction: 1 }),
        ([1, 1, 0, 2, 1, 0, 0, 0, 0, 0], MessageError::Endpoint { endpoint: 1, direction: 2 }),
    ] {
        let mut decoder = Decoder::default();
        decoder.push(&request(words, [0; 8], &[]));
        assert_eq!(decoder.next_request(), Err(error));
        assert_eq!(decoder.next_request(), Err(error), "it stays so");
    }
}

#[test]
fn answers_to_the_byte() {
    let mut answers = Answers::default();
    answers.sent(0x0D05, TransferStatus::Done, b"\x12\x01");
    let bytes = answers.take();
    // Kind, number, then zeros up to the status; length, first packet, packets (none are isochronous).
    assert_eq!(words(&bytes), (vec![3, 0x0D05, 0, 0, 0, 0, 2, 0, -1, 0, 0, 0], &b"\x12\x01"[..]));
    answers.sent(1, TransferStatus::Stalled, &[]);
    assert_eq!(words(&answers.take()).0[5..7], [-32, 0]);
    answers.taken(2, TransferStatus::Done, 31);
    assert_eq!(words(&answers.take()).0[5..7], [0, 31]);
    answers.unlinked(3, TransferStatus::Unlinked);
    assert_eq!(words(&answers.take()).0[..6], [4, 3, 0, 0, 0, -104]);
    assert_eq!(answers.take(), b"");
}

proptest::proptest! {
    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(0_u8..8, 0..300)) {
        let mut decoder = Decoder::default();
        decoder.push(&bytes);
        while let Ok(Some(_)) = decoder.next_request() {}
    }
}
