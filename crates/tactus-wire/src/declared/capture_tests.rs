use std::sync::Arc;

use proptest::prelude::*;

use super::{CaptureReport, Mismatch, Stride, check_capture};
use crate::declared::sniff::tests::noise;
use crate::declared::{Encoder, Format, RawFormat};

/// What the device of these tests really sends.
const TRUE: &str = r#"
schema = "tactus.link/1"
name = "device"
[frame]
bytes = 40
sync = [0xA5, 0x5A]
length = { offset = 2, width = 2, adds = 4 }
[sequence]
offset = 4
width = 1
[timestamp]
offset = 6
width = 4
tick_ns = 1000
[samples]
offset = 10
elements = 14
type = "u16"
[checksum]
kind = "crc16"
polynomial = 0x8005
init = 0xFFFF
reflect = true
xorout = 0
from = 2
"#;

fn format(text: &str) -> Arc<Format> {
    Arc::new(toml::from_str::<RawFormat>(text).unwrap().check().unwrap())
}

fn frames(count: u16) -> Vec<Vec<u8>> {
    let mut encoder = Encoder::new(format(TRUE));
    let mut noise = noise(count.into());
    (0..count)
        .map(|frame| {
            let counts: Vec<f32> =
                (0..14).map(|_| f32::from(frame + u16::from(noise() % 4)) + 1000.0).collect();
            encoder.encode(u64::from(frame) * 33_000 + 77, &counts).unwrap().to_vec()
        })
        .collect()
}

/// The report of 30 frames under the true description with every `from` written as its `to`.
fn report(changes: &[(&str, &str)]) -> CaptureReport {
    let text = changes.iter().fold(TRUE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    check_capture(&format(&text), &frames(30).concat())
}

fn hints(changes: &[(&str, &str)]) -> Vec<String> {
    report(changes).hints.iter().map(ToString::to_string).collect()
}

#[test]
fn a_good_description_needs_no_hint() {
    let report = report(&[]);
    assert_eq!(report.hints, []);
    assert_eq!((report.bytes, report.stats.frames, report.stats.skipped_bytes), (1200, 30, 0));
    assert_eq!((report.first_frame_at, report.first_skipped_at, report.syncs), (Some(0), None, 30));
    assert_eq!(report.strides[0], Stride { bytes: 40, count: 29 });
}

#[test]
fn faults_of_the_capture_are_placed() {
    let mut frames = frames(30);
    frames[3][20] ^= 1;
    frames[5][2] ^= 1;
    frames[7].remove(9);
    let mut capture = vec![1, 2, 3];
    capture.extend(frames.concat());
    let report = check_capture(&format(TRUE), &capture);
    assert_eq!((report.first_frame_at, report.first_skipped_at), (Some(3), Some(0)));
    assert_eq!(report.stats.frames, 27);
    assert_eq!(report.first_bad_checksum.map(|mismatch| mismatch.at), Some(3 + 3 * 40));
    assert_eq!(report.first_bad_length, Some(Mismatch { at: 3 + 5 * 40, expected: 36, found: 37 }));
    assert_eq!(report.hints, []);
    let report = check_capture(&format(TRUE), &capture[3..]);
    assert_eq!(report.first_skipped_at, Some(3 * 40));
}

#[test]
fn another_length_is_seen() {
    // The checksum, last by the description, is looked for at the end of the frames that are there.
    assert_eq!(
        hints(&[("bytes = 40", "bytes = 41"), ("adds = 4", "adds = 5")]),
        [
            "frame.bytes: sync is found every 40 bytes (29 times of 30), but the description says frames of 41",
            "frame.length.adds: the field says 36 in every frame; write adds = 4",
            "checksum.offset: the checksum holds if it is crc16 with polynomial = 0x8005, init = 0xffff, \
         reflect = true, xorout = 0x0000, covers from byte 2, stands at byte 38 and is \"little\"; \
         the description differs in offset",
        ]
    );
}

#[test]
fn another_sync_is_seen() {
    let hints = hints(&[("0xA5, 0x5A", "0x5A, 0xA5")]);
    assert_eq!(
        hints,
        ["frame.sync: the bytes 5A A5 are nowhere; in the opposite order they are there 30 times; A5 5A \
         is there every 40 bytes, first at 0"]
    );
}

#[test]
fn a_sync_at_no_distance_is_seen() {
    let mut noise = noise(3);
    let mut capture = Vec::new();
    for gap in [31, 47, 60, 73, 90, 21] {
        capture.extend([0xA5, 0x5A]);
        capture.extend(core::iter::repeat_with(&mut noise).map(|byte| byte & 0x7F).take(gap));
    }
    let report = check_capture(&format(TRUE), &capture);
    assert_eq!(report.hints.len(), 1);
    let hint = report.hints[0].to_string();
    assert!(hint.starts_with("frame.sync: found 6 times, but neither every 40 bytes"), "{hint}");
}

#[test]
fn the_length_field_is_corrected() {
    assert_eq!(
        hints(&[("adds = 4", "adds = 2")]),
        ["frame.length.adds: the field says 36 in every frame; write adds = 4"]
    );
    assert_eq!(
        hints(&[("adds = 4", "adds = 4, endian = \"big\"")]),
        ["frame.length.endian: the field is right in the other byte order; write \"little\""]
    );
    let varies = hints(&[
        ("offset = 2, width = 2", "offset = 5, width = 1"),
        ("offset = 4\nwidth = 1", "offset = 2\nwidth = 1"),
    ]);
    assert!(varies[0].starts_with("frame.length.adds: the field says 0"), "{varies:?}");
    let varies = hints(&[
        ("length = { offset = 2, width = 2, adds = 4 }", "length = { offset = 4, width = 1, adds = 4 }"),
        ("[sequence]\noffset = 4\nwidth = 1\n", ""),
    ]);
    assert_eq!(
        varies,
        ["frame.length.offset: the field says 0 and 1 in frames of one length; the length lies elsewhere, \
         or leave it out"]
    );
}

#[test]
fn the_checksum_is_corrected() {
    let holds = "the checksum holds if it is crc16 with polynomial = 0x8005, init = 0xffff, reflect = true, \
                 xorout = 0x0000, covers from byte 2, stands at byte 38 and is \"little\"; the description";
    assert_eq!(hints(&[("from = 2", "from = 0")]), [format!("checksum.from: {holds} differs in from")]);
    assert_eq!(
        hints(&[("from = 2", "from = 2\nendian = \"big\"")]),
        [format!("checksum.endian: {holds} differs in endian")]
    );
    assert_eq!(
        hints(&[("init = 0xFFFF", "init = 0"), ("from = 2", "from = 1")]),
        [format!("checksum.kind: {holds} differs in kind, from")]
    );
    let none = &TRUE[TRUE.find("[checksum]").unwrap()..];
    assert_eq!(hints(&[(none, "")]), [format!("checksum: {holds} has none")]);
    let mut frames = frames(30);
    for frame in &mut frames {
        frame[38] ^= frame[12];
    }
    let report = check_capture(&format(TRUE), &frames.concat());
    assert!(
        report.hints[0].to_string().starts_with("checksum.kind: it does not hold, nor"),
        "{:?}",
        report.hints
    );
    assert_eq!(report.first_bad_checksum.map(|mismatch| mismatch.at), Some(0));
}

#[test]
fn counts_and_clocks_are_corrected() {
    assert_eq!(
        hints(&[("[sequence]\noffset = 4", "[sequence]\noffset = 5")]),
        ["sequence.offset: it does not count by one; these bytes do: 4"]
    );
    assert_eq!(
        hints(&[("tick_ns = 1000", "tick_ns = 1000\nendian = \"big\"")]),
        ["timestamp.endian: it runs on evenly in the other byte order; write \"little\""]
    );
    assert_eq!(
        hints(&[("offset = 6\nwidth = 4", "offset = 9\nwidth = 1")]),
        ["timestamp.offset: it never changes; the clock lies elsewhere, or leave it out"]
    );
}

#[test]
fn samples_in_the_other_byte_order_are_seen() {
    let hints = hints(&[("type = \"u16\"", "type = \"u16\"\nendian = \"big\"")]);
    assert_eq!(hints.len(), 1);
    assert!(hints[0].starts_with("samples.endian: from frame to frame the samples change "), "{hints:?}");
    assert!(hints[0].ends_with("write \"little\""), "{hints:?}");
}

#[test]
fn packets_are_looked_at_one_by_one() {
    let text = TRUE.replace("name =", "framing = \"packet\"\nname =").replace("from = 2", "from = 3");
    let hints: Vec<_> =
        check_capture(&format(&text), &frames(30).concat()).hints.iter().map(ToString::to_string).collect();
    assert_eq!(hints.len(), 1);
    assert!(hints[0].contains("covers from byte 2"), "{hints:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_capture_is_looked_at(
        pieces in prop::collection::vec(
            prop_oneof![
                prop::sample::select(frames(8)),
                prop::collection::vec(prop_oneof![Just(0xA5), Just(0x5A), any::<u8>()], 0..60),
            ],
            0..12,
        ),
        packet: bool,
    ) {
        let capture = pieces.concat();
        let framing = if packet { "framing = \"packet\"\nname =" } else { "name =" };
        let text = TRUE.replace("name =", framing);
        let report = check_capture(&format(&text), &capture);
        prop_assert!(report.stats.frames * 40 + report.stats.skipped_bytes <= capture.len() as u64);
        for hint in &report.hints {
            prop_assert!(!hint.to_string().is_empty());
        }
    }
}
