//! What an `anyskin` board may send: frames do not depend on how they arrive.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::arrivals;
use tactus_wire::anyskin::Decoder;

fuzz_target!(|input: &[u8]| {
    let (whole, pieces) = arrivals(input);
    assert_eq!(frames([whole]), frames(pieces));
});

/// As text, in which a number that is none equals itself.
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
