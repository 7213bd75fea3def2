//! What a `weiss-dsa` controller may send: packets do not depend on how they arrive, and no conversation panics.
#![no_main]

use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::{Happening, arrivals, happenings};
use tactus_wire::weiss::{Action, Checksum, Config, Decoder, Session};

type Packets = Vec<Result<(u8, Vec<u8>), String>>;

const ELEMENTS: usize = 4;

fuzz_target!(|input: &[u8]| {
    let (whole, pieces) = arrivals(input);
    for checksum in [Checksum::Crc, Checksum::Sum8] {
        assert_eq!(packets(checksum, [whole]), packets(checksum, pieces.iter().copied()));
        converse(checksum, input);
    }
});

fn packets<'a>(checksum: Checksum, arrivals: impl IntoIterator<Item = &'a [u8]>) -> Packets {
    let mut decoder = Decoder::new().with_checksum(checksum);
    let mut packets = Packets::new();
    for arrival in arrivals {
        decoder.push(arrival);
        while let Some(packet) = decoder.next_packet() {
            packets.push(match packet {
                Ok(packet) => Ok((packet.id, packet.payload.to_vec())),
                Err(error) => Err(error.to_string()),
            });
        }
    }
    packets
}

fn converse(checksum: Checksum, input: &[u8]) {
    let mut session = Session::new(Config { elements: ELEMENTS, fps: 30, run_length: true, checksum });
    let mut now = Duration::ZERO;
    let check = |actions: Vec<Action>| {
        for action in actions {
            if let Action::Frame(reading) = action {
                assert_eq!(reading.counts.len(), ELEMENTS);
            }
        }
    };
    check(session.start(now));
    for happening in happenings(input) {
        check(match happening {
            Happening::Bytes(bytes) => session.receive(now, bytes),
            Happening::Pause(pause) => {
                now += pause;
                continue;
            }
            Happening::Deadline | Happening::Command(_) => {
                now = session.deadline().unwrap_or(now).max(now);
                session.timer(now)
            }
        });
    }
}
