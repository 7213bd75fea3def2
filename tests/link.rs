//! `tactus link check`: a description of frames held against what a device sent, made here byte by byte.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use tactus_e2e::{Said, repository, tactus};
use tempfile::TempDir;

/// CRC-16/CCITT-FALSE, bit by bit: polynomial 0x1021, from 0xFFFF, not reflected.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(
            crc ^ u16::from(*byte) << 8,
            |crc, _| if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x1021 },
        )
    })
}

/// A frame as config/links/digitacts.toml tells it: sync, length, count, clock in ms, 48 samples, checksum.
fn frame(index: u8) -> Vec<u8> {
    let mut bytes = vec![0xAA, 0x55, 101, index];
    bytes.extend((33 * u32::from(index)).to_le_bytes());
    bytes.extend((0..48).flat_map(|element: u16| (100 + 7 * element + u16::from(index) % 3).to_le_bytes()));
    bytes.extend(crc(&bytes[2..]).to_le_bytes());
    bytes
}

/// Forty frames, of which one has a wrong byte, with garbage before them.
fn capture() -> Vec<u8> {
    let mut bytes = vec![1, 2, 3];
    bytes.extend((0..40).flat_map(frame));
    bytes[3 + 20 * 106 + 50] ^= 0x10;
    bytes
}

fn check(folder: &Path, description: &str, args: &[&str]) -> Said {
    fs::write(folder.join("link.toml"), description).unwrap();
    fs::write(folder.join("bytes.bin"), capture()).unwrap();
    tactus(folder, &[&["link", "check", "link.toml"], args].concat())
}

fn shipped() -> String {
    fs::read_to_string(repository("config/links/digitacts.toml")).unwrap()
}

#[test]
fn a_capture_is_decoded_and_where_it_fails_is_told() {
    let folder = TempDir::new().unwrap();
    let said = check(folder.path(), &shipped(), &["--capture", "bytes.bin", "--json"]);
    assert_eq!(said.code, Some(3), "{said:?}");
    let told = said.json();
    assert_eq!(told["format"]["frame_bytes"], 106);
    let capture = &told["capture"];
    assert_eq!([&capture["frames"], &capture["lost_frames"], &capture["bad_checksums"]], [39, 1, 1]);
    assert_eq!([&capture["first_frame_at"], &capture["first_skipped_at"]], [3, 0]);
    assert_eq!(capture["skipped_bytes"], 3 + 106);
    assert_eq!(capture["first_bad_checksum"]["at"], 3 + 20 * 106);
    assert_eq!(capture["strides"][0]["bytes"], 106);
    let aloud = check(folder.path(), &shipped(), &["--capture", "bytes.bin"]);
    assert!(aloud.out.contains("frames            39, the first at byte 3"), "{aloud:?}");
}

#[test]
fn a_wrong_description_is_put_right() {
    let folder = TempDir::new().unwrap();
    let wrong = shipped()
        .replace("bytes = 106", "bytes = 104")
        .replace("elements = 48\nrows = 6", "elements = 47\nrows = 1");
    let said =
        check(folder.path(), &wrong.replace("cols = 8", "cols = 47"), &["--capture", "bytes.bin", "--json"]);
    let told = said.json();
    assert_eq!(said.code, Some(1), "{told}");
    let hints = told["capture"]["hints"].to_string();
    assert!(
        hints.contains("sync is found every 106 bytes") && hints.contains("says frames of 104"),
        "{hints}"
    );

    let big = shipped().replacen("endian = \"little\"\n", "endian = \"big\"\n", 2);
    let said = check(folder.path(), &big, &["--capture", "bytes.bin", "--json"]);
    let hints = said.json()["capture"]["hints"].to_string();
    assert!(hints.contains("the description differs in endian"), "{hints}");
}

#[test]
fn a_contradiction_is_refused_by_the_name_of_its_field() {
    let folder = TempDir::new().unwrap();
    let said = check(folder.path(), &shipped().replace("elements = 48", "elements = 49"), &[]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(said.err.contains("link.toml: samples."), "{said:?}");
    let said = check(folder.path(), &shipped().replace("[checksum]", "[chekcsum]"), &[]);
    assert!(said.err.contains("chekcsum") && said.err.contains("line"), "{said:?}");
    let validated = tactus(folder.path(), &["validate", "link.toml"]);
    assert_eq!(validated.code, Some(1), "{validated:?}");
}
