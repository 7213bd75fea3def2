//! Any description with any bytes. A description that is accepted decodes the same frames however the bytes arrive, and
//! neither its session nor the check of a capture panics.
//!
//! The input is a description in TOML, a zero byte, and the device's bytes.
#![no_main]

use std::sync::Arc;

use libfuzzer_sys::fuzz_target;
use tactus_fuzz::{arrivals, run_sensor};
use tactus_wire::declared::{Decoder, Format, Framing, RawFormat, Session, check_capture, propose};

/// Bytes that are searched for strides and checksums. A longer search would leave no time for the rest.
const SEARCHED_BYTES: usize = 256;

/// A description that is shipped.
const SHIPPED: &str = include_str!("../../config/links/digitacts.toml");

fuzz_target!(|input: &[u8]| {
    let end = input.iter().position(|byte| *byte == 0).unwrap_or(0);
    let (text, bytes) = input.split_at(end);
    let searched = bytes.get(..SEARCHED_BYTES).unwrap_or(bytes);
    let described = std::str::from_utf8(text).ok().and_then(format);
    for format in described.into_iter().chain(format(SHIPPED)) {
        let format = Arc::new(format);
        let (whole, pieces) = arrivals(bytes);
        if format.framing() == Framing::Stream {
            assert_eq!(frames(&format, [whole]), frames(&format, pieces));
        } else {
            frames(&format, pieces);
        }
        run_sensor(Session::new(&format), format.samples().elements(), bytes);
        check_capture(&format, searched);
    }
    propose(searched);
});

fn format(text: &str) -> Option<Format> {
    toml::from_str::<RawFormat>(text).ok()?.check().ok()
}

/// As text, so that NaN equals itself.
fn frames<'a>(format: &Arc<Format>, arrivals: impl IntoIterator<Item = &'a [u8]>) -> Vec<String> {
    let mut decoder = Decoder::new(Arc::clone(format));
    let mut frames = Vec::new();
    for arrival in arrivals {
        decoder.push(arrival);
        while let Some(frame) = decoder.next_frame() {
            assert_eq!(frame.counts.len(), format.samples().elements());
            frames.push(format!("{frame:?}"));
        }
    }
    frames
}
