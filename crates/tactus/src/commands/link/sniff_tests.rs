use super::*;

#[test]
fn devices_are_told_as_people_write_them() {
    for (text, toml) in [
        ("/dev/ttyACM0", "{ kind = \"serial\", path = \"/dev/ttyACM0\", baud = 9600 }"),
        ("serial:0403:6001", "{ kind = \"serial\", usb = { vid = 0x0403, pid = 0x6001 }, baud = 9600 }"),
        (
            "usb:1209:20/A1:3:85",
            "{ kind = \"usb\", vid = 0x1209, pid = 0x0020, serial = \"A1\", interface = 3, endpoint_in = 0x85 }",
        ),
        (
            "usb:303a:1001/7C:DF:01:2:0x81",
            "{ kind = \"usb\", vid = 0x303a, pid = 0x1001, serial = \"7C:DF:01\", interface = 2, endpoint_in = 0x81 }",
        ),
        ("hid:1209:0020/A1", "{ kind = \"hid\", vid = 0x1209, pid = 0x0020, serial = \"A1\" }"),
        ("tcp:10.0.0.7:4001", "{ kind = \"tcp\", address = \"10.0.0.7:4001\" }"),
    ] {
        assert_eq!(transport(text, 9600, None).unwrap().to_toml(), toml);
    }
}

#[test]
fn what_is_no_device_is_refused_with_its_form() {
    for (text, form) in [
        ("usb:1209:0020", "usb:VID:PID[/SERIAL]:INTERFACE:ENDPOINT"),
        ("usb:1209:0020:3:05", "usb:VID:PID[/SERIAL]:INTERFACE:ENDPOINT"),
        ("usb:1209:3:85", "\"1209\" is not VID:PID"),
        ("hid:1209", "VID:PID"),
        ("serial:ttyACM0", "VID:PID"),
    ] {
        let error = transport(text, 9600, None).unwrap_err().to_string();
        assert!(error.contains(form), "{text}: {error}");
    }
}

#[test]
fn bytes_are_shown_in_hexadecimal_and_as_text() {
    let all: Vec<u8> = (0..20).map(|byte| 0x41 + byte).chain([0x00, 0xAA]).collect();
    let mut view = HexView::default();
    // As a serial port gives them, in pieces; and then a packet, which begins a line.
    for (at, piece) in all.chunks(3).enumerate() {
        view.take(3 * at as u64, piece, false);
    }
    assert_eq!(view.lines, ["00000000  41 42 43 44 45 46 47 48 49 4a 4b 4c 4d 4e 4f 50  |ABCDEFGHIJKLMNOP|"]);
    let mut view = HexView::default();
    view.take(16, &all[16..], true);
    view.take(22, b"ok", true);
    let hex = |line: &str| format!("{line:57}");
    assert_eq!(
        view.lines,
        [
            format!("{}  |QRST..|", hex("00000010  51 52 53 54 00 aa")),
            format!("{}  |ok|", hex("00000016  6f 6b"))
        ]
    );
}

#[test]
fn of_many_bytes_some_are_shown_and_the_others_counted() {
    let mut view = HexView::default();
    view.take(0, &[0; 1000], true);
    assert_eq!((view.lines.len(), view.hidden_bytes), (LINES_MAX, 1000 - 16 * LINES_MAX as u64));
    view.print();
    assert_eq!((view.lines.len(), view.hidden_bytes), (0, 0));
}

fn capture(transport: &str, packets: &[&[u8]]) -> Capture {
    let mut capture = Capture::new(&super::transport(transport, 9600, None).unwrap(), None).unwrap();
    for packet in packets {
        capture.take(packet).unwrap();
    }
    capture
}

#[test]
fn packets_of_one_length_are_seen_to_be_frames() {
    let hid = "hid:1209:0020";
    let alike = capture(hid, &[&[1; 64], &[2; 64]]);
    assert_eq!((alike.packet_bytes(), alike.bytes, alike.reads), (Some(64), 128, 2));
    assert_eq!(capture(hid, &[&[1; 64], &[2; 63]]).packet_bytes(), None);
    assert_eq!(capture("/dev/ttyACM0", &[&[1; 64]]).packet_bytes(), None);
    assert_eq!(capture(hid, &[]).packet_bytes(), None);
}

#[test]
fn what_to_do_next_follows_from_what_came() {
    let next = |capture: &Capture| next(capture, &propose(&capture.head));
    assert!(next(&capture("hid:1209:0020", &[])).starts_with("no bytes arrived"));
    let unsaved = capture("hid:1209:0020", &[&[1; 64]]);
    assert!(next(&unsaved).contains("--save bytes.bin"));
    let folder = tempfile::TempDir::new().unwrap();
    let save = folder.path().join("bytes.bin");
    let mut saved =
        Capture { save: Some((save.clone(), BufWriter::new(File::create(&save).unwrap()))), ..unsaved };
    saved.take(&[2; 64]).unwrap();
    saved.finish().unwrap();
    assert_eq!(std::fs::read(&save).unwrap(), [2; 64]);
    let told = next(&saved);
    assert!(told.contains("framing = \"packet\" and frame.bytes = 64"), "{told}");
    assert!(told.ends_with(&format!("tactus link check FILE --capture {}", save.display())), "{told}");
    assert_eq!(array(&[0xAA, 0x05]), "[0xAA, 0x05]");
}
