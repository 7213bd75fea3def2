use super::{FormatError, RawFormat};
use crate::declared::Format;

const GOOD: &str = r#"
schema = "tactus.link/1"
name = "array"
[frame]
bytes = 20
sync = [0xAA, 0x55]
trailer = [0x0D, 0x0A]
length = { offset = 2, width = 1, adds = 4 }
[samples]
offset = 6
elements = 4
rows = 2
cols = 2
type = "u16"
[sequence]
offset = 3
width = 1
[timestamp]
offset = 4
width = 2
tick_ns = 1000000
[checksum]
kind = "crc16"
polynomial = 0x1021
init = 0xFFFF
reflect = false
xorout = 0
check = 0x29B1
from = 2
[usb]
interface = 1
endpoint = 0x81
"#;

fn format(text: &str) -> Result<Format, FormatError> {
    toml::from_str::<RawFormat>(text).unwrap().check()
}

/// With `from` written as `to`, the description must be refused at `field`, with `words` in the problem.
fn refused(from: &str, to: &str, field: &str, words: &str) {
    assert!(GOOD.contains(from), "{from}");
    let error = format(&GOOD.replacen(from, to, 1)).unwrap_err();
    assert_eq!(error.field, field, "{error}");
    assert!(error.problem.contains(words), "{error}");
}

#[test]
fn a_good_description_is_taken() {
    let format = format(GOOD).unwrap();
    assert_eq!(format.name(), "array");
    assert_eq!(format.frame_bytes(), 20);
    assert_eq!(format.tick_ns(), Some(1e6));
    assert_eq!(format.usb_interface_and_endpoint(), Some((1, 0x81)));
    assert_eq!(format.hid_report_id(), None);
    assert_eq!(format.checksum.as_ref().map(|checksum| (checksum.from, checksum.to)), Some((2, 16)));
}

#[test]
fn a_description_is_written_as_it_was_read() {
    let raw: RawFormat = toml::from_str(GOOD).unwrap();
    let again: RawFormat = toml::from_str(&toml::to_string(&raw).unwrap()).unwrap();
    assert_eq!(again, raw);
}

#[test]
fn contradictions_are_named() {
    refused("link/1", "link/2", "schema", "tactus.link/1");
    refused("\"array\"", "\"\"", "name", "empty");
    refused("bytes = 20", "bytes = 0", "frame.bytes", "not 1 to 65536");
    refused("bytes = 20", "bytes = 70000", "frame.bytes", "not 1 to 65536");
    refused("bytes = 20", "bytes = 13", "samples.offset", "frame of 13");
    refused("bytes = 20", "bytes = 15", "samples.offset", "frame.trailer");
    refused("bytes = 20", "bytes = 1", "frame.sync", "behind the frame of 1");
    refused("sync = [0xAA, 0x55]", "sync = []", "frame.sync", "a stream needs bytes");
    refused(
        "sync = [0xAA, 0x55]",
        "sync = [0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]",
        "frame.sync",
        "16 are enough",
    );
    refused("adds = 4", "adds = 21", "frame.length.adds", "20 bytes less 21");
    refused("adds = 4", "adds = -300", "frame.length.adds", "1 bytes can say");
    refused("offset = 2, width = 1", "offset = 2, width = 9", "frame.length.width", "not 1 to 8");
    refused("offset = 2, width = 1", "offset = 1, width = 1", "frame.length.offset", "frame.sync");
    refused("elements = 4", "elements = 5", "samples.elements", "2 rows of 2 are not 5");
    refused("elements = 4", "elements = 0", "samples.elements", "not 1 to");
    refused("rows = 2\n", "", "samples.rows", "missing");
    refused("cols = 2\n", "", "samples.cols", "missing");
    refused("rows = 2\ncols = 2\n", "order = \"column-major\"\n", "samples.order", "needs samples.rows");
    refused("type = \"u16\"", "type = \"u16\"\norder = [0, 1, 2]", "samples.order", "lists 3");
    refused("type = \"u16\"", "type = \"u16\"\norder = [0, 1, 2, 2]", "samples.order", "2 is there twice");
    refused("type = \"u16\"", "type = \"u16\"\norder = [0, 1, 2, 4]", "samples.order", "0 to 3");
    refused("type = \"u16\"", "type = \"u16\"\nbad = [65536]", "samples.bad", "65536");
    refused("type = \"u16\"", "type = \"u16\"\nbad = [0.5]", "samples.bad", "0.5");
    refused("type = \"u16\"", "type = \"u32\"", "samples.offset", "frame of 20");
    refused("offset = 6", "offset = 5", "timestamp.offset", "samples.offset");
    refused("offset = 6", "offset = 20", "samples.offset", "behind the frame");
    refused("offset = 6", "offset = -21", "samples.offset", "outside the frame");
    refused("width = 1\n[timestamp]", "width = 1\nwrap = 257\n[timestamp]", "sequence.wrap", "2 to 256");
    refused("tick_ns = 1000000", "tick_ns = 0", "timestamp.tick_ns", "clock in ms");
    refused("tick_ns = 1000000", "tick_ns = nan", "timestamp.tick_ns", "clock in ms");
    refused("polynomial = 0x1021", "polynomial = 0x11021", "checksum.polynomial", "16 bits");
    refused("polynomial = 0x1021\n", "", "checksum.polynomial", "CCITT-FALSE");
    refused("init = 0xFFFF", "init = 0", "checksum.check", "0x31c3, not 0x29b1");
    refused("kind = \"crc16\"", "kind = \"sum8\"", "checksum.polynomial", "belongs to a crc");
    refused("from = 2", "from = 16", "checksum.from", "nothing lies");
    refused("from = 2", "to = 18", "checksum.to", "no byte of its own");
    refused("from = 2", "offset = 13", "checksum.offset", "samples.offset");
    refused("endpoint = 0x81", "endpoint = 0x02", "usb.endpoint", "0x82");
    refused("[usb]\ninterface = 1\nendpoint = 0x81", "[hid]\nreport_id = 1", "framing", "packet");
}

#[test]
fn a_checksum_of_no_kind_is_none() {
    let text =
        GOOD.replace("polynomial = 0x1021\ninit = 0xFFFF\nreflect = false\nxorout = 0\ncheck = 0x29B1\n", "");
    assert_eq!(format(&text.replace("crc16", "none")).unwrap().checksum, None);
    let checked = text.replace("\"crc16\"", "\"none\"\ncheck = 1");
    assert_eq!(format(&checked).unwrap_err().field, "checksum.check");
}

#[test]
fn numbered_reports_begin_with_their_id() {
    let text = GOOD
        .replace("name = ", "framing = \"packet\"\nname = ")
        .replace("[usb]\ninterface = 1\nendpoint = 0x81", "[hid]\nreport_id = 7");
    let error = format(&text).unwrap_err();
    assert_eq!(error.field, "frame.length.offset", "the id moves the sync bytes by one");
    let format = format(&text.replace("sync = [0xAA, 0x55]", "sync = [0xAA]")).unwrap();
    assert_eq!(format.head, [7, 0xAA]);
    assert_eq!(format.hid_report_id(), Some(7));
}

#[test]
fn what_is_no_order_says_what_is_one() {
    let error =
        toml::from_str::<RawFormat>(&GOOD.replace("type =", "order = \"zigzag\"\ntype =")).unwrap_err();
    assert!(error.to_string().contains("order is \"row-major\""), "{error}");
}

#[test]
fn unknown_keys_are_refused() {
    let error = toml::from_str::<RawFormat>(&GOOD.replace("tick_ns", "tick_us")).unwrap_err();
    assert!(error.to_string().contains("tick_us"), "{error}");
}
