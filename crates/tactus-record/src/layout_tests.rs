use mcap::records::op;

use super::fits;

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
fn a_whole_record_fits() {
    for (opcode, body) in records() {
        assert!(fits(opcode, &body), "kind {opcode}");
    }
}

#[test]
fn a_record_cut_anywhere_does_not() {
    for (opcode, body) in records() {
        for length in 0..body.len() {
            assert!(!fits(opcode, &body[..length]), "kind {opcode} cut at {length}");
        }
    }
}

#[test]
fn a_length_beyond_the_record_does_not() {
    for (opcode, body) in records().into_iter().filter(|(opcode, _)| *opcode != op::MESSAGE) {
        let length_at = match opcode {
            op::SCHEMA => 2,
            op::CHANNEL => 4,
            op::ATTACHMENT => 16,
            _ => 0,
        };
        let mut long = body;
        long[length_at..length_at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(!fits(opcode, &long), "kind {opcode}");
    }
}

#[test]
fn an_attachment_with_bytes_left_over_does_not_fit() {
    let [.., (opcode, mut body)] = records();
    body.push(0);
    assert!(!fits(opcode, &body));
}
