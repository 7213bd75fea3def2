//! Any bytes from a `weiss-dsa` controller: packets do not depend on how they arrive, and no session panics.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::{arrivals, run_sensor};
use tactus_wire::weiss::{Checksum, Config, Decoder, Session};

type Packets = Vec<Result<(u8, Vec<u8>), String>>;

const ROWS: usize = 2;
const COLS: usize = 2;

fuzz_target!(|input: &[u8]| {
    let (whole, pieces) = arrivals(input);
    for checksum in [Checksum::Crc, Checksum::Sum8] {
        assert_eq!(packets(checksum, [whole]), packets(checksum, pieces.iter().copied()));
        let config = Config { rows: ROWS, cols: COLS, fps: 30, run_length: true, checksum };
        run_sensor(Session::new(config), ROWS * COLS, input);
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
