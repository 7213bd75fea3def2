//! The descriptions in `config/links`.

use std::sync::Arc;

use crate::declared::{Decoder, Encoder, Format, RawFormat};

fn shipped(name: &str) -> Arc<Format> {
    let path = format!("{}/../../config/links/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap();
    let format = toml::from_str::<RawFormat>(&text).unwrap().check().unwrap();
    assert_eq!(format.name(), name);
    Arc::new(format)
}

#[test]
fn every_shipped_description_is_good() {
    let folder = format!("{}/../../config/links", env!("CARGO_MANIFEST_DIR"));
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_owned())
        .collect();
    names.sort();
    for name in &names {
        shipped(name.to_str().unwrap());
    }
    assert_eq!(names, ["digitacts", "digitacts-hid", "pr2-fingertip"]);
}

#[test]
fn digitacts() {
    let format = shipped("digitacts");
    let mut golden = vec![0xAA, 0x55, 101, 0, 0x15, 0xCD, 0x5B, 0x07];
    golden.extend((0..48u8).flat_map(|element| [element, 1]));
    // The checksum by a separate program.
    golden.extend([0x82, 0xE8]);
    let counts: Vec<f32> = (0..48u16).map(|element| (256 + element).into()).collect();
    let mut encoder = Encoder::new(Arc::clone(&format));
    assert_eq!(encoder.encode(123_456_789, &counts).unwrap(), golden);
    let mut decoder = Decoder::new(format);
    decoder.push(&golden);
    let frame = decoder.next_frame().unwrap();
    assert_eq!((frame.sequence, frame.tick), (Some(0), Some(123_456_789)));
    assert_eq!(frame.counts, counts);
}

#[test]
fn pr2_fingertip() {
    let format = shipped("pr2-fingertip");
    let mut packet = vec![0x10, 0x27, 0, 0];
    packet.extend((1..=20u8).flat_map(|cell| [cell, 0x80]));
    packet.extend([0, 0, 0xFF, 0xFF]);
    packet.extend([0x77; 46]);
    let mut decoder = Decoder::new(format);
    for stale in [false, true] {
        decoder.push(&packet);
        let frame = decoder.next_frame().unwrap();
        assert_eq!((frame.tick, frame.stale), (Some(10_000), stale));
        assert_eq!(frame.counts[..2], [384., 640.]);
        assert_eq!(frame.bad, [20, 21]);
    }
    packet[0] = 0x11;
    decoder.push(&packet);
    assert!(!decoder.next_frame().unwrap().stale);
}

#[test]
fn the_example_in_the_documentation_is_good() {
    let documentation = include_str!("../declared.rs");
    let example: String = documentation
        .lines()
        .map_while(|line| line.strip_prefix("//!"))
        .skip_while(|line| *line != " ```toml")
        .skip(1)
        .take_while(|line| *line != " ```")
        .flat_map(|line| [line, "\n"])
        .collect();
    let format = toml::from_str::<RawFormat>(&example.replace("[3, 0, ...]", "")).unwrap().check().unwrap();
    assert_eq!((format.name(), format.frame_bytes()), ("my array", 104));
}
