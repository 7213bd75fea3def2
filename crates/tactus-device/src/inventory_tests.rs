use serialport::UsbPortInfo;

use super::*;
use crate::bus::tests::{BOARD, sysfs};

fn port(name: &str, serial: Option<&str>) -> SerialPortInfo {
    SerialPortInfo {
        port_name: name.to_owned(),
        port_type: SerialPortType::UsbPort(UsbPortInfo {
            vid: 0x0403,
            pid: 0x6001,
            serial_number: serial.map(str::to_owned),
            manufacturer: None,
            product: Some("FT232R".to_owned()),
        }),
    }
}

fn nobody() -> Holders {
    Holders::read(Path::new("/nowhere/at/all"))
}

#[test]
fn a_serial_port_is_told_by_its_device_and_else_by_its_link_or_place() {
    let dev = tempfile::TempDir::new().unwrap();
    let name = |name: &str| dev.path().join(name).display().to_string();
    let by_id = dev.path().join("by-id");
    fs::create_dir(&by_id).unwrap();
    for (node, link) in
        [("ttyUSB0", "usb-FT232R_A1"), ("ttyUSB1", "usb-Dual_B2-if00"), ("ttyUSB2", "usb-Dual_B2-if01")]
    {
        fs::write(dev.path().join(node), "").unwrap();
        std::os::unix::fs::symlink(format!("../{node}"), by_id.join(link)).unwrap();
    }
    let ports = [
        port(&name("ttyUSB0"), Some("A1")),
        port(&name("ttyUSB1"), Some("B2")),
        port(&name("ttyUSB2"), Some("B2")),
        port(&name("ttyUSB3"), None),
        SerialPortInfo { port_name: name("ttyS0"), port_type: SerialPortType::Unknown },
    ];
    let found = serial_ports(&ports, &by_id);
    let told: Vec<_> = found.iter().map(|one| (one.transport.to_string(), one.is_stable)).collect();
    let link = |name: &str| by_id.join(name).display().to_string();
    assert_eq!(
        told,
        [
            ("serial:0403:6001/A1".to_owned(), true),
            (link("usb-Dual_B2-if00"), true),
            (link("usb-Dual_B2-if01"), true),
            (name("ttyUSB3"), false),
            (name("ttyS0"), true),
        ]
    );
    assert_eq!(found[0].by_id, Some(by_id.join("usb-FT232R_A1")));
    assert_eq!(found[0].product.as_deref(), Some("FT232R"));

    let serial = |port| Transport::Serial { port, baud: 9600 };
    let by_path = serial(SerialPort::Path(link("usb-FT232R_A1")));
    assert!(found[0].is_meant_by(&by_path) && !found[1].is_meant_by(&by_path));
    let by_device = serial(SerialPort::Usb("0403:6001/B2".parse().unwrap()));
    assert!(!found[0].is_meant_by(&by_device) && found[2].is_meant_by(&by_device));
    assert!(!found[4].is_meant_by(&by_device) && !found[0].is_meant_by(&Transport::Embedded));
}

#[test]
fn of_usb_the_vendors_own_interfaces_are_found_with_their_endpoints() {
    let root = sysfs(BOARD);
    let devices = bus::devices(root.path());
    let found = usb_interfaces(&devices, &nobody());
    let told: Vec<_> = found.iter().map(|one| one.transport.to_toml()).collect();
    let identity = "{ kind = \"usb\", vid = 0x1209, pid = 0x0020, serial = \"C1\", interface = 3";
    assert_eq!(
        told,
        [
            format!("{identity}, endpoint_in = 0x85, endpoint_out = 0x05 }}"),
            format!("{identity}, endpoint_in = 0x86 }}"),
        ]
    );
    assert!(found.iter().all(|one| one.is_stable && one.access == Access::Free));
    let link = |identity: &str, interface| {
        let identity = identity.parse().unwrap();
        Transport::Usb(UsbLink { identity, interface, endpoint_in: 0x85, endpoint_out: None })
    };
    assert!(found[0].is_meant_by(&link("1209:0020", 3)));
    assert!(!found[0].is_meant_by(&link("1209:0020", 1)));
    assert!(!found[0].is_meant_by(&link("1209:0020/D2", 3)));
}

#[test]
fn an_interface_that_a_program_has_claimed_is_held_and_one_of_a_driver_is_none_of_ours() {
    let root = sysfs(BOARD);
    let with = |driver: &str| {
        let mut devices = bus::devices(root.path());
        devices[1].interfaces[1].driver = Some(driver.to_owned());
        usb_interfaces(&devices, &nobody())
    };
    assert!(with("usbfs").iter().all(|one| one.access == Access::Held(None)));
    assert_eq!(with("ftdi_sio"), []);
}

#[test]
fn two_devices_that_are_alike_are_not_stable() {
    let root = sysfs(BOARD);
    let mut devices = bus::devices(root.path());
    devices.push(UsbDevice { address: 9, ..devices[1].clone() });
    assert!(usb_interfaces(&devices, &nobody()).iter().all(|one| !one.is_stable));
}

#[test]
fn of_human_interface_devices_those_for_people_are_left_out() {
    let node = |path: &str, serial: Option<&str>, usage| HidNode {
        path: path.into(),
        vid: 0x1209,
        pid: 0x20,
        serial: serial.map(str::to_owned),
        product: None,
        interface: Some(2),
        usages: vec![(0xFF00, 1), usage],
    };
    let found = hid_nodes(vec![
        node("/dev/hidraw0", None, (1, 6)),
        node("/dev/hidraw1", Some("C1"), (0xFF00, 2)),
        node("/dev/hidraw2", None, (0xFF00, 2)),
    ]);
    let told: Vec<_> = found.iter().map(|one| (one.transport.to_toml(), one.is_stable)).collect();
    let hid = "{ kind = \"hid\", vid = 0x1209, pid = 0x0020";
    assert_eq!(
        told,
        [
            (format!("{hid}, serial = \"C1\", interface = 2 }}"), true),
            (format!("{hid}, interface = 2 }}"), false)
        ]
    );
    let link = |interface| {
        Transport::Hid(HidLink { identity: "1209:0020/C1".parse().unwrap(), interface, report_bytes: None })
    };
    assert!(found[0].is_meant_by(&link(None)) && found[0].is_meant_by(&link(Some(2))));
    assert!(!found[0].is_meant_by(&link(Some(0))) && !found[1].is_meant_by(&link(None)));
}

#[test]
fn whatever_is_there_can_be_listed() {
    for found in inventory().unwrap() {
        assert!(found.node.starts_with("/dev"), "{found:?}");
        assert!(found.is_meant_by(&found.transport), "{found:?}");
    }
}
