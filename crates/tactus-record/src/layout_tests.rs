use mcap::records::op;

use super::{inner_bytes, is_whole};

fn text(text: &str) -> Vec<u8> {
    [&u32::try_from(text.len()).unwrap().to_le_bytes(), text.as_bytes()].concat()
}

fn map(pairs: &[(&str, &str)]) -> Vec<u8> {
    let pairs: Vec<u8> = pairs.iter().flat_map(|(name, value)| [text(name), text(value)].concat()).collect();
    [&u32::try_from(pairs.len()).unwrap().to_le_bytes(), pairs.as_slice()].concat()
}

fn records() -> [(u8, Vec<u8>); 5] {
    let times = [0; 16];
    let blob = [&3u64.to_le_bytes()[..], b"abc"].concat();
    [
        (op::SCHEMA, [&[1, 0][..], &text("tactus.v1.Frame"), &text("protobuf"), &text("data")].concat()),
        (
            op::CHANNEL,
            [&[1, 0, 1, 0][..], &text("topic"), &text("protobuf"), &map(&[("a", "b"), ("c", "")])].concat(),
        ),
        (op::MESSAGE, vec![0; 22]),
        (op::METADATA, [text("tactus.run"), map(&[("run_id", "1")])].concat()),
        (op::ATTACHMENT, [&times[..], &text("rig.json"), &text("application/json"), &blob, &[0; 4]].concat()),
    ]
}

#[test]
fn a_whole_record_is_whole() {
    for (opcode, body) in records() {
        assert!(is_whole(opcode, &body), "kind {opcode}");
    }
}

#[test]
fn a_record_cut_anywhere_is_not() {
    for (opcode, body) in records() {
        for length in 0..body.len() {
            assert!(!is_whole(opcode, &body[..length]), "kind {opcode} cut at {length}");
        }
    }
}

#[test]
fn a_length_beyond_the_record_is_noticed() {
    for (opcode, body) in records().into_iter().filter(|(opcode, _)| *opcode != op::MESSAGE) {
        let length_at = match opcode {
            op::SCHEMA => 2,
            op::CHANNEL => 4,
            op::ATTACHMENT => 16,
            _ => 0,
        };
        let mut long = body;
        long[length_at..length_at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(!is_whole(opcode, &long), "kind {opcode}");
    }
}

#[test]
fn bytes_left_over_are_noticed_and_do_not_count() {
    for (opcode, mut body) in records().into_iter().filter(|(opcode, _)| *opcode != op::MESSAGE) {
        let bytes = body.len();
        body.push(0);
        assert!(!is_whole(opcode, &body), "kind {opcode}");
        assert_eq!(inner_bytes(opcode, &body), Some(bytes), "kind {opcode}");
    }
}

/// Every kind of record that a recording has, as the `mcap` crate writes it.
#[test]
fn the_records_of_a_real_file_are_whole() {
    let mut writer = mcap::Writer::new(std::io::Cursor::new(Vec::new())).unwrap();
    let metadata = std::collections::BTreeMap::from([("a".to_owned(), "b".to_owned())]);
    writer.write_metadata(&mcap::records::Metadata { name: "m".into(), metadata: metadata.clone() }).unwrap();
    let attachment = mcap::Attachment {
        log_time: 1,
        create_time: 2,
        name: "file".into(),
        media_type: "text/plain".into(),
        data: b"text".as_slice().into(),
    };
    writer.attach(&attachment).unwrap();
    let schema = writer.add_schema("s", "protobuf", b"data").unwrap();
    let channel_id = writer.add_channel(schema, "topic", "protobuf", &metadata).unwrap();
    let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, b"message").unwrap();
    writer.finish().unwrap();
    let file = writer.into_inner().into_inner();
    let mut rest = &file[mcap::MAGIC.len()..file.len() - mcap::MAGIC.len()];
    let mut kinds = std::collections::BTreeSet::new();
    while let Some((&opcode, after)) = rest.split_first() {
        let (length, after) = after.split_first_chunk().unwrap();
        let (body, after) = after.split_at(usize::try_from(u64::from_le_bytes(*length)).unwrap());
        assert!(is_whole(opcode, body), "kind {opcode}");
        kinds.insert(opcode);
        rest = after;
    }
    assert_eq!(kinds.len(), 14, "all kinds but messages outside of chunks: {kinds:?}");
}
