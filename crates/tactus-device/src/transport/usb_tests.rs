use std::collections::VecDeque;

use rustix::io::Errno;

use super::*;
use crate::bus::tests::{BOARD, sysfs};

fn link(interface: u8, endpoint_in: u8, endpoint_out: Option<u8>) -> UsbLink {
    UsbLink { identity: "1209:0020/C1".parse().unwrap(), interface, endpoint_in, endpoint_out }
}

fn board() -> UsbDevice {
    let root = sysfs(BOARD);
    the_one("usb", &link(3, 0x85, None).identity, bus::devices(root.path()), APART).unwrap()
}

#[test]
fn the_endpoints_that_the_rig_file_names_are_chosen() {
    let board = board();
    let both = choose(&board, &link(3, 0x85, Some(0x05))).unwrap();
    assert_eq!((both.read.kind, both.read.packet_bytes), (EndpointKind::Bulk, 512));
    assert_eq!(both.write.map(|endpoint| endpoint.address), Some(0x05));
    let one = choose(&board, &link(3, 0x86, None)).unwrap();
    assert_eq!((one.read.kind, one.read.packet_bytes, one.write), (EndpointKind::Interrupt, 64, None));
}

#[test]
fn another_interface_or_endpoint_is_another_device_and_what_is_there_is_told() {
    let board = board();
    for (link, says) in [
        (link(2, 0x85, None), "it has no interface 2, but 1, 3: put interface right"),
        (link(1, 0x81, None), "interface 1 has no bulk or interrupt endpoint 0x81, but none at all"),
        (
            link(3, 0x81, None),
            "no bulk or interrupt endpoint 0x81, but 0x05 (bulk), 0x85 (bulk), 0x86 (interrupt)",
        ),
        (link(3, 0x87, None), "no bulk or interrupt endpoint 0x87"),
        (link(3, 0x85, Some(0x04)), "endpoint 0x04, but 0x05 (bulk)"),
    ] {
        let refusal = choose(&board, &link).unwrap_err();
        assert!(refusal.contains(says), "{says}: {refusal}");
    }
}

#[test]
fn permission_absence_and_others_programs_are_told_apart() {
    let board = board();
    let explain = |error| {
        let DeviceError { kind, what, .. } = explain("usb:1209:0020/C1", &board, 3, error);
        (kind, what)
    };
    let (kind, what) = explain(rusb::Error::Access);
    assert_eq!(kind, ErrorKind::Permission);
    assert!(what.contains("/dev/bus/usb/001/007") && what.contains("70-tactus.rules"), "{what}");
    assert!(what.contains("ATTR{idVendor}==\"1209\", ATTR{idProduct}==\"0020\""), "{what}");
    for (kind, errno) in [
        (ErrorKind::Permission, Errno::ACCESS),
        (ErrorKind::Permission, Errno::PERM),
        (ErrorKind::Absent, Errno::NOENT),
    ] {
        assert_eq!(refused("usb", &board, errno.into()).map(|error| error.kind), Some(kind));
    }
    assert!(refused("usb", &board, Errno::BUSY.into()).is_none());
    let (kind, what) = explain(rusb::Error::Busy);
    assert_eq!(kind, ErrorKind::Busy);
    assert!(what.contains("another program holds interface 3"), "{what}");
    assert_eq!(explain(rusb::Error::NoDevice).0, ErrorKind::Absent);
    assert_eq!(explain(rusb::Error::NotFound).0, ErrorKind::WrongDevice);
    assert_eq!(explain(rusb::Error::Io).0, ErrorKind::DeviceFault);
}

/// What reads give, one after the other; then the device is gone.
struct Scripted {
    reads: VecDeque<rusb::Result<Vec<u8>>>,
    cleared: usize,
}

impl Pipe for Scripted {
    fn read(&mut self, packet: &mut [u8], _: Duration) -> rusb::Result<usize> {
        let read = self.reads.pop_front().unwrap_or(Err(rusb::Error::NoDevice))?;
        packet[..read.len()].copy_from_slice(&read);
        Ok(read.len())
    }

    fn clear_halt(&mut self) -> rusb::Result<()> {
        self.cleared += 1;
        Ok(())
    }
}

fn source(kind: EndpointKind, reads: Vec<rusb::Result<Vec<u8>>>) -> UsbSource<Scripted> {
    let endpoint = UsbEndpoint { address: 0x85, kind, packet_bytes: 4 };
    UsbSource::new("usb".into(), Scripted { reads: reads.into(), cleared: 0 }, endpoint)
}

#[expect(clippy::unnecessary_wraps, reason = "stands among reads that fail")]
fn read(bytes: &[u8]) -> rusb::Result<Vec<u8>> {
    Ok(bytes.to_vec())
}

/// What it gives until the device is gone.
fn all(source: &mut UsbSource<Scripted>) -> Vec<Option<Vec<u8>>> {
    std::iter::from_fn(|| source.next().ok()).collect()
}

#[test]
fn a_transfer_ends_with_a_packet_that_is_not_full() {
    let mut source = source(
        EndpointKind::Bulk,
        vec![read(b"abcd"), read(b"efgh"), read(b"ij"), read(b"kl"), read(b"mnop"), read(b""), read(b"q")],
    );
    let transfers = [b"abcdefghij".as_slice(), b"kl", b"mnop", b"q"];
    assert_eq!(all(&mut source), transfers.map(|transfer| Some(transfer.to_vec())));
}

#[test]
fn a_transfer_also_ends_when_nothing_follows() {
    let quiet = || Err(rusb::Error::Timeout);
    let mut source =
        source(EndpointKind::Bulk, vec![read(b"abcd"), quiet(), quiet(), read(b"efgh"), quiet()]);
    assert_eq!(all(&mut source), [Some(b"abcd".to_vec()), None, Some(b"efgh".to_vec())]);
}

#[test]
fn packets_of_an_interrupt_endpoint_stand_for_themselves() {
    let mut source = source(EndpointKind::Interrupt, vec![read(b"abcd"), read(b"efgh"), read(b"i")]);
    let packets = [b"abcd".as_slice(), b"efgh", b"i"];
    assert_eq!(all(&mut source), packets.map(|packet| Some(packet.to_vec())));
}

#[test]
fn a_stall_is_cleared_once_and_a_second_in_a_row_breaks_the_link() {
    let stall = || Err(rusb::Error::Pipe);
    let mut source = source(
        EndpointKind::Bulk,
        vec![
            read(b"a"),
            stall(),
            Err(rusb::Error::Timeout),
            read(b"b"),
            stall(),
            read(b"c"),
            stall(),
            stall(),
        ],
    );
    let one = |byte: u8| Some(vec![byte]);
    assert_eq!(all(&mut source), [one(b'a'), None, None, one(b'b'), None, one(b'c'), None]);
    assert_eq!(source.pipe.cleared, 3);
}

#[test]
fn a_device_that_is_unplugged_is_not_connected() {
    let error = source(EndpointKind::Bulk, vec![]).next().unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::NotConnected);
    assert_eq!(broken(rusb::Error::Io).kind(), io::ErrorKind::BrokenPipe);
}

#[tokio::test]
async fn a_device_that_is_not_there_is_absent() {
    let identity = "1209:ffff/none".parse().unwrap();
    let connector = UsbConnector::new(UsbLink { identity, ..link(3, 0x85, None) });
    let error = connector.connect().await.err().expect("it opened");
    assert_eq!(error.kind, ErrorKind::Absent);
    assert!(error.to_string().starts_with("usb:1209:ffff/none: there is no such device"), "{error}");
}
