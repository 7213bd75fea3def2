//! Any bytes from an `anyskin` board: frames do not depend on how they arrive, and no session panics.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::{arrivals, run_sensor};
use tactus_wire::anyskin::{Decoder, MAGNETOMETERS, Session};

fuzz_target!(|input: &[u8]| {
    let (whole, pieces) = arrivals(input);
    assert_eq!(frames([whole]), frames(pieces));
    run_sensor(Session::new(), 3 * MAGNETOMETERS, input);
});

/// As text, so that NaN equals itself.
fn frames<'a>(arrivals: impl IntoIterator<Item = &'a [u8]>) -> Vec<String> {
    let mut decoder = Decoder::new();
    let mut frames = Vec::new();
    for arrival in arrivals {
        decoder.push(arrival);
        while let Some(frame) = decoder.next_frame() {
            frames.push(format!("{frame:?}"));
        }
    }
    frames
}
