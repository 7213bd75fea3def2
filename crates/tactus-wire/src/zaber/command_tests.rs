use proptest::prelude::*;

use super::{HostCommand, HostCommandDecoder};

fn command(device: u8, axis: u8, id: Option<u8>, text: &str) -> HostCommand {
    HostCommand { device, axis, id, text: text.to_owned() }
}

#[test]
fn a_host_sends_these_bytes() {
    assert_eq!(command(1, 1, Some(7), "move abs 10000").encode(false), b"/1 1 07 move abs 10000\n");
    assert_eq!(command(1, 1, Some(7), "move abs 10000").encode(true), b"/1 1 07 move abs 10000:B9\n");
    assert_eq!(command(0, 0, None, "").encode(false), b"/0 0\n");
    // The sum of "hello" is 0x214.
    assert_eq!(HostCommand::parse("/hello:EC"), Some(command(0, 0, None, "hello")));
}

#[test]
fn a_device_reads_these_lines() {
    let golden = [
        ("/", command(0, 0, None, "")),
        ("/home", command(0, 0, None, "home")),
        ("/1 home", command(1, 0, None, "home")),
        ("/1 2 home", command(1, 2, None, "home")),
        ("/01 2 33 move vel -100", command(1, 2, Some(33), "move vel -100")),
        ("/1 2 -- get pos", command(1, 2, None, "get pos")),
        ("/  1  2  get pos ", command(1, 2, None, "get pos")),
    ];
    for (line, command) in golden {
        assert_eq!(HostCommand::parse(line), Some(command), "{line}");
    }
    for line in ["", "home", "/home:00", "/home:4", "/1 tools\\"] {
        assert_eq!(HostCommand::parse(line), None, "{line}");
    }
}

#[test]
fn what_is_no_command_is_counted() {
    let mut decoder = HostCommandDecoder::default();
    let mut found = Vec::new();
    decoder.push(b"/1 1 00 get", |command| found.push(command));
    decoder.push(b" pos\n\r\nnoise\r\n\xFF\n/2 0 stop\r", |command| found.push(command));
    assert_eq!(found, [command(1, 1, Some(0), "get pos"), command(2, 0, None, "stop")]);
    assert_eq!(decoder.dropped(), 2);
}

proptest! {
    #[test]
    fn any_line_is_read_or_refused(line in "/?\\PC{0,60}") {
        drop(HostCommand::parse(&line));
    }

    #[test]
    fn what_is_encoded_is_read(
        (device, axis, id) in (0..=99u8, 0..=9u8, 0..=99u8),
        text in "[a-z]{1,8}( [a-z0-9.-]{1,8}){0,3}",
        with_checksum: bool,
    ) {
        let command = command(device, axis, Some(id), &text);
        let bytes = command.encode(with_checksum);
        prop_assert_eq!(HostCommand::parse(str::from_utf8(&bytes).unwrap().trim_end()), Some(command));
    }
}
