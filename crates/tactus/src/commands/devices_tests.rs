use tactus_device::Holder;

use super::*;

const SIM: &str = include_str!("../../../../config/rigs/sim.toml");

fn found(serial: &str, access: Access) -> FoundDevice {
    let identity: tactus_schema::rig::UsbIdentity = format!("0403:6001/{serial}").parse().unwrap();
    FoundDevice {
        transport: Transport::Serial { port: SerialPort::Usb(identity.clone()), baud: 115_200 },
        is_stable: true,
        identity: Some(identity),
        product: Some("FT232R".into()),
        node: "/dev/ttyUSB0".into(),
        by_id: Some("/dev/serial/by-id/usb-FT232R".into()),
        access,
    }
}

/// A rig whose sensor is the device with the serial number A1, and whose stage is a serial port that is not there.
fn rigs() -> Rigs {
    let embedded = "transport = { kind = \"embedded\" }";
    let transport = format!("transport = {}", found("A1", Access::Free).transport.to_toml());
    let text = SIM.replacen(embedded, &transport, 1).replacen(
        embedded,
        "transport = { kind = \"serial\", usb = { vid = 1, pid = 2 }, baud = 9600 }",
        1,
    );
    let mut rigs = Rigs { are_named: true, ..Rigs::default() };
    rigs.add(&Rig::from_toml(&text).unwrap());
    rigs
}

#[test]
fn a_row_says_whose_a_device_is_and_whether_it_may_be_opened() {
    let held = Access::Held(Some(Holder { pid: 7, name: "tactusd".into() }));
    let want = [
        "serial",
        "FT232R",
        "0403:6001/A1",
        "/dev/serial/by-id/usb-FT232R",
        "in use by tactusd (7)",
        "sim (sensor)",
    ];
    assert_eq!(row(&found("A1", held), &rigs()), want);
    assert_eq!(row(&found("B2", Access::Denied), &rigs())[4..], ["no permission", "-"]);
}

#[test]
fn for_machines_everything_is_told_and_what_a_named_rig_misses() {
    let told = to_json(&[found("A1", Access::Free)], &rigs());
    let device = &told["devices"][0];
    assert_eq!([&device["kind"], &device["access"], &device["serial"]], ["serial", "free", "A1"]);
    assert_eq!(device["rigs"][0], json!({ "rig": "sim", "role": "sensor" }));
    assert_eq!(
        device["transport"],
        "{ kind = \"serial\", usb = { vid = 0x0403, pid = 0x6001, serial = \"A1\" }, baud = 115200 }"
    );
    assert_eq!(told["missing"], json!([{ "rig": "sim", "role": "stage" }]));
    assert_eq!(told["hint"], Value::Null);
    let unnamed = Rigs { are_named: false, ..rigs() };
    assert_eq!(to_json(&[], &unnamed)["missing"], json!([]));
    assert!(to_json(&[], &unnamed)["hint"].as_str().unwrap().contains("dmesg"));
}
