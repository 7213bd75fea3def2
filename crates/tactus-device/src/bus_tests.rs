use std::os::unix::fs::symlink;

use tempfile::TempDir;

use super::*;

/// Writes a tree as the system shows it: a device, its interfaces, their drivers and endpoints.
pub(crate) fn sysfs(devices: &[(&str, &[(&str, &str)])]) -> TempDir {
    let root = TempDir::new().unwrap();
    for (folder, attributes) in devices {
        let folder = root.path().join(folder);
        fs::create_dir_all(&folder).unwrap();
        for (name, value) in *attributes {
            if *name == "driver" {
                symlink(format!("../../../bus/usb/drivers/{value}"), folder.join("driver")).unwrap();
            } else {
                fs::write(folder.join(name), format!("{value}\n")).unwrap();
            }
        }
    }
    root
}

/// A board with a serial port and a vendor's interface, and a hub.
pub(crate) const BOARD: &[(&str, &[(&str, &str)])] = &[
    ("usb1", &[("busnum", "1"), ("devnum", "1"), ("idVendor", "1d6b"), ("idProduct", "0002")]),
    ("usb1/1-0:1.0", &[("bInterfaceNumber", "00"), ("bInterfaceClass", "09"), ("driver", "hub")]),
    (
        "1-1",
        &[
            ("busnum", "1"),
            ("devnum", "7"),
            ("idVendor", "1209"),
            ("idProduct", "0020"),
            ("serial", "C1"),
            ("product", "Emu composite"),
        ],
    ),
    ("1-1/1-1:1.1", &[("bInterfaceNumber", "01"), ("bInterfaceClass", "0a"), ("driver", "cdc_acm")]),
    ("1-1/1-1:1.3", &[("bInterfaceNumber", "03"), ("bInterfaceClass", "ff")]),
    ("1-1/1-1:1.3/ep_85", &[("bEndpointAddress", "85"), ("type", "Bulk"), ("wMaxPacketSize", "0200")]),
    ("1-1/1-1:1.3/ep_05", &[("bEndpointAddress", "05"), ("type", "Bulk"), ("wMaxPacketSize", "0200")]),
    ("1-1/1-1:1.3/ep_86", &[("bEndpointAddress", "86"), ("type", "Interrupt"), ("wMaxPacketSize", "1040")]),
    ("1-1/1-1:1.3/ep_87", &[("bEndpointAddress", "87"), ("type", "Isoc"), ("wMaxPacketSize", "0040")]),
    ("1-1:1.3", &[("bInterfaceNumber", "03"), ("bInterfaceClass", "ff")]),
    ("1-2", &[("busnum", "1"), ("devnum", "garbage"), ("idVendor", "1209"), ("idProduct", "0020")]),
];

#[test]
fn devices_are_read_with_their_interfaces_and_endpoints() {
    let root = sysfs(BOARD);
    let devices = devices(root.path());
    assert_eq!(devices.len(), 2, "{devices:?}");
    let [hub, board] = devices.as_slice() else { unreachable!() };
    assert_eq!((hub.serial.as_deref(), hub.interfaces[0].class), (None, 9));
    assert_eq!((board.vid, board.pid, board.serial.as_deref()), (0x1209, 0x20, Some("C1")));
    assert_eq!(board.node(), Path::new("/dev/bus/usb/001/007"));
    let [serial, own] = board.interfaces.as_slice() else { panic!("{board:?}") };
    assert_eq!((serial.number, serial.driver.as_deref()), (1, Some("cdc_acm")));
    assert_eq!((own.number, own.class, own.driver.as_deref()), (3, 0xFF, None));
    let endpoint = |address, kind, packet_bytes| UsbEndpoint { address, kind, packet_bytes };
    let want = [
        endpoint(0x05, EndpointKind::Bulk, 512),
        endpoint(0x85, EndpointKind::Bulk, 512),
        endpoint(0x86, EndpointKind::Interrupt, 64),
        endpoint(0x87, EndpointKind::Other, 64),
    ];
    assert_eq!(own.endpoints, want);
}

#[test]
fn where_there_is_no_usb_there_are_no_devices() {
    assert_eq!(devices(Path::new("/nowhere/at/all")), []);
}
