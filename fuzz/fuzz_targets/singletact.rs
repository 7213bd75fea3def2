//! What goes over a `singletact` link, either way: packets do not depend on how they arrive, and no poll panics.
#![no_main]

use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::{Happening, arrivals, happenings};
use tactus_wire::singletact::{Action, Config, Decoder, Session};

const ADDRESSES: [u8; 2] = [4, 5];

fuzz_target!(|input: &[u8]| {
    let (whole, pieces) = arrivals(input);
    assert_eq!(replies([whole]), replies(pieces.iter().copied()));
    assert_eq!(requests([whole]), requests(pieces));
    poll(input);
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

fn poll(input: &[u8]) {
    let config = Config { addresses: ADDRESSES.to_vec(), interval: Duration::from_millis(10) };
    let Ok(mut session) = Session::new(config) else { unreachable!("two addresses that differ") };
    let mut now = Duration::ZERO;
    let mut actions = session.start(now);
    for happening in happenings(input) {
        for action in actions {
            if let Action::Reading(reading) = action {
                assert!(reading.element < ADDRESSES.len());
            }
        }
        actions = match happening {
            Happening::Bytes(bytes) => session.receive(now, bytes),
            Happening::Pause(pause) => {
                now += pause;
                Vec::new()
            }
            Happening::Deadline | Happening::Command(_) => {
                now = session.deadline().unwrap_or(now).max(now);
                session.timer(now)
            }
        };
    }
}
