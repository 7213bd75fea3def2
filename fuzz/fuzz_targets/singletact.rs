//! Any bytes on a `singletact` link, in either direction: packets do not depend on how they arrive, and no session panics.
#![no_main]

use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::{arrivals, run_sensor};
use tactus_wire::singletact::{Config, Decoder, Session};

const ADDRESSES: [u8; 2] = [4, 5];

fuzz_target!(|input: &[u8]| {
    let (whole, pieces) = arrivals(input);
    assert_eq!(replies([whole]), replies(pieces.iter().copied()));
    assert_eq!(requests([whole]), requests(pieces));
    let config = Config { addresses: ADDRESSES.to_vec(), interval: Duration::from_millis(10) };
    let Ok(session) = Session::new(config) else { unreachable!("two addresses that differ") };
    run_sensor(session, ADDRESSES.len(), input);
});

fn replies<'a>(arrivals: impl IntoIterator<Item = &'a [u8]>) -> Vec<String> {
    let mut decoder = Decoder::new();
    let mut replies = Vec::new();
    for arrival in arrivals {
        decoder.push(arrival);
        while let Some(reply) = decoder.next_reply() {
            replies.push(format!("{reply:?}"));
        }
    }
    replies
}

fn requests<'a>(arrivals: impl IntoIterator<Item = &'a [u8]>) -> Vec<String> {
    let mut decoder = Decoder::new();
    let mut requests = Vec::new();
    for arrival in arrivals {
        decoder.push(arrival);
        while let Some(request) = decoder.next_request() {
            requests.push(format!("{request:?}"));
        }
    }
    requests
}
