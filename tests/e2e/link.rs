//! `tactus link check`: compares a description of frames with a device's bytes, which the test makes.
//! `tactus link sniff`: the same bytes, sent by a device at a pseudo-terminal.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use rustix::process::Signal;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use serde_json::Value;
use tactus_e2e::{CommandOutput, Process, repository, tactus};
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

/// A sequence of 0 to 3 that does not repeat.
fn noise(index: u8, element: u16) -> u16 {
    let mixed = (u32::from(index) << 16 | u32::from(element)).wrapping_mul(0x9E37_79B9);
    u16::try_from((mixed ^ mixed >> 15).wrapping_mul(0x85EB_CA77) >> 30).unwrap()
}

/// A frame in the format of config/links/digitacts.toml: sync, length, count, clock in ms, 48 samples, checksum.
fn frame(index: u8) -> Vec<u8> {
    let mut bytes = vec![0xAA, 0x55, 101, index];
    bytes.extend((33 * u32::from(index)).to_le_bytes());
    bytes.extend((0..48).flat_map(|element| (100 + 7 * element + noise(index, element)).to_le_bytes()));
    bytes.extend(crc(&bytes[2..]).to_le_bytes());
    bytes
}

/// Garbage, then forty frames; one of them has a wrong byte.
fn capture() -> Vec<u8> {
    let mut bytes = vec![1, 2, 3];
    bytes.extend((0..40).flat_map(frame));
    bytes[3 + 20 * 106 + 50] ^= 0x10;
    bytes
}

fn check(folder: &Path, description: &str, args: &[&str]) -> CommandOutput {
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
    assert!(aloud.out.contains("frames          39, the first at byte 3"), "{aloud:?}");
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

/// The near end of a pseudo-terminal, and the path of the far end.
fn terminal() -> (File, String) {
    // Otherwise child processes inherit the near end, and the device never disappears.
    let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&near).unwrap();
    unlockpt(&near).unwrap();
    let path = ptsname(&near, Vec::new()).unwrap().into_string().unwrap();
    (near.into(), path)
}

#[test]
fn what_a_device_sends_is_saved_and_its_frames_are_proposed() {
    let folder = TempDir::new().unwrap();
    let (mut device, path) = terminal();
    // As many bytes as a pseudo-terminal takes before anybody reads.
    let sent = &capture()[..3200];
    let arguments = ["link", "sniff", &path, "--json", "--bytes", "3200", "--save", "bytes.bin"];
    let mut sniff = Process::start("tactus", folder.path(), &arguments);
    sniff.wait_for(&format!("listening to {path}"));
    device.write_all(sent).unwrap();
    let line = sniff.wait_for("proposals");
    assert_eq!(sniff.wait().0, Some(0));
    let told: Value = serde_json::from_str(&line).unwrap();
    assert_eq!(
        [&told["bytes"], &told["broken"], &told["packets"]],
        [&3200.into(), &Value::Null, &Value::Null]
    );
    let proposal = &told["proposals"][0];
    assert_eq!([&proposal["stride"], &proposal["first_at"]], [106, 3], "{proposal}");
    assert_eq!(proposal["sync"], serde_json::json!([0xAA, 0x55]), "{proposal}");
    let next = told["next"].as_str().unwrap();
    assert!(next.contains("frame.bytes = 106") && next.contains("--capture bytes.bin"), "{next}");
    assert_eq!(fs::read(folder.path().join("bytes.bin")).unwrap(), sent);

    // The next step, with the shipped description.
    fs::write(folder.path().join("link.toml"), shipped()).unwrap();
    let checked = tactus(folder.path(), &["link", "check", "link.toml", "--capture", "bytes.bin", "--json"]);
    assert_eq!(checked.json()["capture"]["frames"], 29);
}

#[test]
fn listening_ends_well_with_an_interrupt_and_when_the_device_goes() {
    let folder = TempDir::new().unwrap();
    let (device, path) = terminal();
    let mut sniff = Process::start("tactus", folder.path(), &["link", "sniff", &path]);
    sniff.wait_for("listening");
    sniff.signal(Signal::INT);
    let (code, said) = sniff.wait();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("next: no bytes arrived: is the device switched on"), "{said}");

    let mut sniff = Process::start("tactus", folder.path(), &["link", "sniff", &path]);
    sniff.wait_for("listening");
    drop(device);
    let (code, said) = sniff.wait();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("ended  "), "{said}");
}

#[test]
fn a_device_that_cannot_be_opened_is_told_with_what_to_do() {
    let folder = TempDir::new().unwrap();
    for (device, code, says) in [
        ("/dev/serial/by-id/none", 1, "there is no such port"),
        ("usb:1209:ffff/none:3:85", 1, "usb:1209:ffff/none: there is no such device"),
        ("hid:1209:ffff/none", 1, "hid:1209:ffff/none: there is no such device"),
        ("usb:1209:ffff", 2, "is not usb:VID:PID[/SERIAL]:INTERFACE:ENDPOINT"),
    ] {
        let said = tactus(folder.path(), &["link", "sniff", device]);
        assert_eq!(said.code, Some(code), "{said:?}");
        assert!(said.err.contains(says), "{said:?}");
    }
}
