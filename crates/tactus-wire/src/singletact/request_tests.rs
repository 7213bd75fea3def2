use proptest::prelude::*;

use super::{Operation, Request, RequestError};
use crate::singletact::Decoder;

fn reads_as<'a>(bytes: &[u8], decoder: &'a mut Decoder) -> Option<Request<'a>> {
    decoder.push(bytes);
    decoder.next_request()
}

/// Laid out by hand after the published program.
#[test]
fn golden_bytes() {
    assert_eq!(
        Request::reading(4, 0x2A).encode().unwrap(),
        [0xFF, 0xFF, 0xFF, 0xFF, 4, 100, 0x2A, 1, 128, 6, 0xFF, 0xFE, 0xFE, 0xFE, 0xFE, 0]
    );
    let write = Operation::Write { location: 10, data: &[1, 2] };
    assert_eq!(
        Request { address: 9, id: 1, operation: write }.encode().unwrap(),
        [0xFF, 0xFF, 0xFF, 0xFF, 9, 100, 1, 2, 10, 2, 1, 2, 0xFF, 0xFE, 0xFE, 0xFE, 0xFE]
    );
    let calibrate = Operation::Calibrate { location: 31, data: &[7] };
    assert_eq!(
        Request { address: 4, id: 2, operation: calibrate }.encode().unwrap(),
        [0xFF, 0xFF, 0xFF, 0xFF, 4, 100, 2, 4, 31, 1, 7, 0xFF, 0xFE, 0xFE, 0xFE, 0xFE]
    );
}

#[test]
fn what_does_not_fit_is_refused() {
    let encode = |address, operation| Request { address, id: 0, operation }.encode().unwrap_err();
    let read = |location, bytes| encode(4, Operation::Read { location, bytes });
    assert_eq!(encode(128, Request::default().operation), RequestError::Address { address: 128 });
    assert_eq!(read(0, 33), RequestError::Length { bytes: 33 });
    assert_eq!(read(190, 2), RequestError::Location { location: 190, bytes: 2 });
    let write = |location, data| encode(4, Operation::Write { location, data });
    assert_eq!(write(0, &[]), RequestError::Length { bytes: 0 });
    assert_eq!(write(0, &[0; 29]), RequestError::Length { bytes: 29 });
    assert_eq!(write(127, &[0; 2]), RequestError::Location { location: 127, bytes: 2 });
    assert_eq!(read(190, 2).to_string(), "location 190 and 2 bytes: reads end at 191, writes at 128");
}

#[test]
fn the_zero_behind_a_read_belongs_to_it() {
    let mut decoder = Decoder::new();
    let read = Request::reading(4, 1).encode().unwrap();
    for _ in 0..3 {
        assert_eq!(reads_as(&read, &mut decoder), Some(Request::reading(4, 1)));
    }
    assert_eq!(reads_as(&read[..15], &mut decoder), Some(Request::reading(4, 1)));
    assert_eq!(reads_as(&read, &mut decoder), Some(Request::reading(4, 1)));
    assert_eq!(decoder.next_request(), None);
    assert_eq!(decoder.stats().skipped_bytes, 0);
}

proptest! {
    #[test]
    fn round_trip(
        address in 0..0x80u8,
        id: u8,
        location in 0..100u8,
        data in prop::collection::vec(any::<u8>(), 1..=28),
        code in 0..3u8,
    ) {
        let operation = match code {
            0 => Operation::Read { location, bytes: 28 },
            1 => Operation::Write { location, data: &data },
            _ => Operation::Calibrate { location, data: &data },
        };
        let request = Request { address, id, operation };
        let mut decoder = Decoder::new();
        prop_assert_eq!(reads_as(&request.encode().unwrap(), &mut decoder), Some(request));
        prop_assert_eq!(decoder.next_request(), None);
        prop_assert_eq!(decoder.stats().skipped_bytes, 0);
    }
}
