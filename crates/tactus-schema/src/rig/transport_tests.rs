use super::*;
use crate::Rig;

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

/// The sensor's transport of the shipped rig with this in its place.
fn read(transport: &str) -> Result<Transport, String> {
    let embedded = "transport = { kind = \"embedded\" }";
    assert!(SIM.contains(embedded), "the shipped rig is embedded no more");
    let text = SIM.replacen(embedded, &format!("transport = {transport}"), 1);
    let rig = Rig::from_toml(&text).map_err(|error| error.to_string())?;
    Ok(rig.service.unwrap().sensor.transport)
}

fn identity(serial: Option<&str>) -> UsbIdentity {
    UsbIdentity { vid: 0x1209, pid: 0x20, serial: serial.map(str::to_owned) }
}

fn all() -> Vec<(Transport, &'static str)> {
    let odd = "A \"1\\";
    vec![
        (Transport::Embedded, "embedded"),
        (Transport::Serial { port: SerialPort::Path("/dev/ttyACM0".into()), baud: 9600 }, "/dev/ttyACM0"),
        (
            Transport::Serial { port: SerialPort::Usb(identity(Some("A1"))), baud: 115_200 },
            "serial:1209:0020/A1",
        ),
        (Transport::Serial { port: SerialPort::Usb(identity(None)), baud: 1 }, "serial:1209:0020"),
        (
            Transport::Usb(UsbLink {
                identity: identity(Some("A1")),
                interface: 3,
                endpoint_in: 0x85,
                endpoint_out: Some(0x05),
            }),
            "usb:1209:0020/A1",
        ),
        (
            Transport::Usb(UsbLink {
                identity: identity(Some(odd)),
                interface: 0,
                endpoint_in: 0x81,
                endpoint_out: None,
            }),
            "usb:1209:0020/A \"1\\",
        ),
        (
            Transport::Hid(HidLink { identity: identity(None), interface: Some(2), report_bytes: Some(64) }),
            "hid:1209:0020",
        ),
        (
            Transport::Hid(HidLink { identity: identity(Some("A1")), interface: None, report_bytes: None }),
            "hid:1209:0020/A1",
        ),
        (Transport::Tcp { address: "10.0.0.7:4001".into() }, "tcp:10.0.0.7:4001"),
    ]
}

#[test]
fn what_is_written_for_a_rig_file_reads_back() {
    for (transport, name) in all() {
        assert_eq!(read(&transport.to_toml()).as_ref(), Ok(&transport));
        assert_eq!(transport.to_string(), name);
    }
}

#[test]
fn the_documented_forms_are_transports() {
    let documentation = include_str!("transport.rs");
    let forms: Vec<_> =
        documentation.lines().filter_map(|line| line.strip_prefix("//! transport = ")).collect();
    assert_eq!(forms.len(), 6);
    for form in forms {
        read(form).unwrap();
    }
}

#[test]
fn what_is_wrong_is_refused_by_the_name_of_its_field() {
    for (transport, refusal) in [
        (
            "{ kind = \"serial\", baud = 9600 }",
            "sensor.transport: a serial transport needs one of path and usb",
        ),
        (
            "{ kind = \"serial\", path = \"/dev/ttyACM0\", usb = { vid = 1, pid = 2 }, baud = 9600 }",
            "sensor.transport: a serial transport needs one of path and usb",
        ),
        ("{ kind = \"serial\", path = \"\", baud = 9600 }", "sensor.transport.path: empty"),
        ("{ kind = \"serial\", path = \"/dev/ttyACM0\", baud = 0 }", "sensor.transport.baud: "),
        (
            "{ kind = \"serial\", usb = { vid = 65536, pid = 2 }, baud = 9600 }",
            "sensor.transport.usb.vid: 65536 is not in 0 to 0xFFFF",
        ),
        (
            "{ kind = \"usb\", vid = 1, pid = -2, interface = 0, endpoint_in = 0x81 }",
            "sensor.transport.pid: -2",
        ),
        (
            "{ kind = \"usb\", vid = 1, pid = 2, interface = 256, endpoint_in = 0x81 }",
            "sensor.transport.interface: 256",
        ),
        (
            "{ kind = \"usb\", vid = 1, pid = 2, interface = 0, endpoint_in = 0x05 }",
            "sensor.transport.endpoint_in: 0x05 is not in 0x81 to 0x8f",
        ),
        (
            "{ kind = \"usb\", vid = 1, pid = 2, interface = 0, endpoint_in = 0x81, endpoint_out = 0x81 }",
            "sensor.transport.endpoint_out: 0x81 is not in 0x01 to 0x0f",
        ),
        ("{ kind = \"hid\", vid = 1, pid = 2, serial = \"\" }", "sensor.transport.serial: empty"),
        (
            "{ kind = \"hid\", vid = 1, pid = 2, report_bytes = 0 }",
            "sensor.transport.report_bytes: 0 is not in 1 to 16384",
        ),
    ] {
        let error = read(transport).unwrap_err();
        assert!(error.starts_with(refusal), "{transport}: {error}");
    }
}

#[test]
fn unknown_and_missing_keys_are_refused_and_named() {
    for (transport, key) in [
        ("{ kind = \"serial\", path = \"/dev/ttyACM0\", baud = 9600, parity = \"odd\" }", "parity"),
        ("{ kind = \"serial\", usb = { vid = 1, pid = 2, sn = \"A1\" }, baud = 9600 }", "sn"),
        ("{ kind = \"usb\", vid = 1, pid = 2, interface = 0, endpoint = 0x81 }", "endpoint"),
        ("{ kind = \"usb\", vid = 1, pid = 2, interface = 0 }", "endpoint_in"),
        ("{ kind = \"hid\", vid = 1, pid = 2, usage = 3 }", "usage"),
        ("{ kind = \"bluetooth\", address = \"00\" }", "bluetooth"),
    ] {
        let error = read(transport).unwrap_err();
        assert!(error.contains(&format!("`{key}`")) && error.contains("line"), "{transport}: {error}");
    }
}

#[test]
fn an_identity_is_read_as_it_is_shown() {
    for text in ["1209:0020", "1209:0020/A1", "303a:1001/7C:DF:A1:00:00:01", "0403:6001/with / slash"] {
        assert_eq!(text.parse::<UsbIdentity>().unwrap().to_string(), text);
    }
    assert_eq!("403:6001".parse(), Ok(UsbIdentity { vid: 0x403, pid: 0x6001, serial: None }));
    for text in ["", "1209", "1209:", ":0020", "12090:0020", "1209:+020", "1209:0020/", "x:y", "1209:0020:3"]
    {
        let error = text.parse::<UsbIdentity>().unwrap_err();
        assert!(error.to_string().contains("VID:PID"), "{error}");
    }
}

#[test]
fn an_identity_without_a_serial_number_is_of_any_device_of_its_kind() {
    let (any, one) = (identity(None), identity(Some("A1")));
    assert!(any.is_of(0x1209, 0x20, None) && any.is_of(0x1209, 0x20, Some("A1")));
    assert!(one.is_of(0x1209, 0x20, Some("A1")));
    for (vid, pid, serial) in [
        (0x1209, 0x20, None),
        (0x1209, 0x20, Some("B2")),
        (0x1209, 0x21, Some("A1")),
        (0x1208, 0x20, Some("A1")),
    ] {
        assert!(!one.is_of(vid, pid, serial));
    }
}
