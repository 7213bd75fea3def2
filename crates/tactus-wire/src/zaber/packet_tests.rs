use proptest::prelude::*;

use super::{Header, Message, Packet, PacketError};
use crate::zaber::Flag;

fn flag(text: &str) -> Flag {
    Flag::parse(text).unwrap()
}

fn reply(header: Header, accepted: bool, busy: bool, flag: Flag, data: &str) -> Message {
    Message::Reply { header, accepted, busy, flag, data: data.to_owned() }
}

#[test]
fn each_kind_of_line() {
    let whole = Header { device: 1, axis: 0, id: None };
    let axis = Header { device: 1, axis: 2, id: Some(7) };
    let golden = [
        ("@01 0 OK IDLE -- 0", reply(whole, true, false, Flag::NONE, "0"), false, false),
        ("@01 2 07 OK BUSY WR 10000", reply(axis, true, true, flag("WR"), "10000"), false, false),
        ("@01 2 07 RJ IDLE NI BADDATA", reply(axis, false, false, flag("NI"), "BADDATA"), false, false),
        ("@01 0 OK IDLE -- 0:8D", reply(whole, true, false, Flag::NONE, "0"), true, false),
        ("@01 0 OK IDLE -- part1\\", reply(whole, true, false, Flag::NONE, "part1"), false, true),
        ("#01 2 07 any text", Message::Info { header: axis, data: "any text".into() }, false, false),
        (
            "!01 2 IDLE FS",
            Message::Alert {
                header: Header { id: None, ..axis },
                busy: false,
                flag: Flag::STALLED,
                data: String::new(),
            },
            false,
            false,
        ),
    ];
    for (line, message, checked, more) in golden {
        assert_eq!(Packet::parse(line), Ok(Packet { message, checked, more }), "{line}");
    }
}

#[test]
fn broken_lines_say_what_is_wrong() {
    let field = |field| PacketError::Field { field };
    for (line, error) in [
        ("", PacketError::Kind),
        ("/1 home", PacketError::Kind),
        ("@01 0 OK IDLE -- 0:8E", PacketError::Checksum),
        ("@01 0 OK IDLE -- 0:8", PacketError::Checksum),
        ("@01 0 OK IDLE -- 0:+D", PacketError::Checksum),
        ("@", field("device address")),
        ("@00 0 OK IDLE -- 0", field("device address")),
        ("@001 0 OK IDLE -- 0", field("device address")),
        ("@01 x OK IDLE -- 0", field("axis number")),
        ("@01 0 7 OK IDLE -- 0", field("reply flag")),
        ("@01 0 NO IDLE -- 0", field("reply flag")),
        ("@01 0 OK WAIT -- 0", field("status")),
        ("@01 0 OK IDLE --- 0", field("warning flag")),
        ("!01 0 IDLE", field("warning flag")),
    ] {
        assert_eq!(Packet::parse(line), Err(error), "{line}");
    }
}

#[test]
fn a_device_sends_these_bytes() {
    let header = Header { device: 1, axis: 1, id: Some(42) };
    let message = reply(header, true, false, flag("WR"), "10000");
    assert_eq!(message.encode(false), b"@01 1 42 OK IDLE WR 10000\r\n");
    assert_eq!(message.encode(true), b"@01 1 42 OK IDLE WR 10000:F6\r\n");
    let alert = Message::Alert { header, busy: false, flag: Flag::STALLED, data: String::new() };
    assert_eq!(alert.encode(false), b"!01 1 IDLE FS\r\n");
    let long = Message::Info { header, data: ["12345678"; 12].join(" ") };
    assert_eq!(
        String::from_utf8(long.encode(false)).unwrap(),
        "#01 1 42 12345678 12345678 12345678 12345678 12345678 12345678 12345678\\\r\n\
         #01 1 42 cont 1 12345678 12345678 12345678 12345678 12345678\r\n"
    );
}

proptest! {
    #[test]
    fn any_line_is_read_or_refused(line in "[@#!]?\\PC{0,60}") {
        drop(Packet::parse(&line));
    }

    #[test]
    fn what_is_encoded_is_read(
        (device, axis, id) in (1..=99u8, 0..=9u8, prop::option::of(0..=99u8)),
        (accepted, busy, with_checksum) in any::<(bool, bool, bool)>(),
        data in "[a-z0-9.-]{1,10}( [a-z0-9.-]{1,10}){0,3}",
    ) {
        let message = reply(Header { device, axis, id }, accepted, busy, Flag::STALLED, &data);
        let bytes = message.encode(with_checksum);
        let line = str::from_utf8(&bytes).unwrap().trim_end();
        prop_assert_eq!(Packet::parse(line), Ok(Packet { message, checked: with_checksum, more: false }));
    }
}
