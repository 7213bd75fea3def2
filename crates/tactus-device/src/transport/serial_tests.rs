use serialport::{SerialPortInfo, SerialPortType, UsbPortInfo};
use tactus_schema::rig;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio_serial::{SerialPort, SerialStream};

use super::{APART, SerialConnector, the_one};
use crate::transport::Connect;
use crate::{DeviceError, ErrorKind};

async fn error(path: &str) -> DeviceError {
    SerialConnector::new(path, 115_200).connect().await.err().expect("it opened")
}

#[tokio::test]
async fn an_absent_port_is_absent_and_the_text_says_what_to_do() {
    let error = error("/dev/serial/by-id/usb-tactus-none").await;
    assert_eq!(error.kind, ErrorKind::Absent);
    let text = error.to_string();
    assert!(text.starts_with("/dev/serial/by-id/usb-tactus-none: there is no such port"), "{text}");
    assert!(text.contains("plugged in"), "{text}");
}

#[tokio::test]
async fn a_file_is_no_serial_port() {
    assert_eq!(error("/dev/null").await.kind, ErrorKind::Protocol);
    assert_eq!(error("/etc").await.kind, ErrorKind::Protocol);
}

/// The path of the far end of a new pseudo-terminal, whose near end is given too.
fn terminal() -> (SerialStream, String) {
    let (near, mut far) = SerialStream::pair().unwrap();
    far.set_exclusive(false).unwrap();
    let path = far.name().unwrap();
    (near, path)
}

#[tokio::test]
async fn bytes_go_through_a_pseudo_terminal_unchanged() {
    let (mut device, path) = terminal();
    let mut host = SerialConnector::new(path, 115_200).connect().await.unwrap();
    // Among them everything that a terminal in its usual mode would change or swallow.
    let all: Vec<u8> = (0..=u8::MAX).collect();
    let mut read = vec![0; all.len()];
    host.write_all(&all).await.unwrap();
    device.read_exact(&mut read).await.unwrap();
    assert_eq!(read, all);
    device.write_all(&all).await.unwrap();
    host.read_exact(&mut read).await.unwrap();
    assert_eq!(read, all);
}

#[tokio::test]
async fn a_second_way_to_the_port_writes_to_the_same_device() {
    let (mut device, path) = terminal();
    let host = SerialConnector::new(path, 115_200).connect().await.unwrap();
    let mut second = host.second_writer().unwrap();
    second.write_all(b"!").unwrap();
    let mut read = [0];
    device.read_exact(&mut read).await.unwrap();
    assert_eq!(read, *b"!");
}

#[tokio::test]
async fn a_port_is_free_once_its_link_and_the_second_way_are_dropped() {
    let (_device, path) = terminal();
    let connector = SerialConnector::new(path, 115_200);
    let host = connector.connect().await.unwrap();
    let second = host.second_writer().unwrap();
    drop(host);
    assert_eq!(connector.connect().await.err().expect("it opened twice").kind, ErrorKind::Busy);
    drop(second);
    assert!(connector.connect().await.is_ok());
}

#[tokio::test]
async fn a_port_that_somebody_holds_is_busy() {
    let (_device, path) = terminal();
    let connector = SerialConnector::new(&path, 115_200);
    let held = connector.connect().await.unwrap();
    let error = connector.connect().await.err().expect("it opened twice");
    assert_eq!(error.kind, ErrorKind::Busy);
    assert!(error.to_string().contains("another program holds the port"), "{error}");
    drop(held);
    connector.connect().await.unwrap();
}

#[tokio::test]
async fn a_port_that_is_told_by_its_device_is_looked_for() {
    let port = rig::SerialPort::Usb("1209:ffff/none".parse().unwrap());
    let error = SerialConnector::of(port, 9600).connect().await.err().expect("it opened");
    assert_eq!(error.kind, ErrorKind::Absent);
    assert!(error.to_string().starts_with("serial:1209:ffff/none: there is no such device"), "{error}");
}

#[test]
fn of_several_ports_the_one_with_the_serial_number_is_meant() {
    let port = |name: &str, serial: Option<&str>| SerialPortInfo {
        port_name: name.to_owned(),
        port_type: SerialPortType::UsbPort(UsbPortInfo {
            vid: 0x0403,
            pid: 0x6001,
            serial_number: serial.map(str::to_owned),
            manufacturer: None,
            product: None,
        }),
    };
    let other = SerialPortInfo { port_name: "/dev/ttyS0".into(), port_type: SerialPortType::Unknown };
    let find = |identity: &str| {
        let ports = vec![other.clone(), port("/dev/ttyUSB0", Some("A1")), port("/dev/ttyUSB1", Some("B2"))];
        the_one("serial", &identity.parse().unwrap(), ports, APART).map(|port| port.port_name)
    };
    assert_eq!(find("0403:6001/B2").unwrap(), "/dev/ttyUSB1");
    let error = find("0403:6001").unwrap_err();
    assert_eq!(error.kind, ErrorKind::WrongDevice);
    let text = error.to_string();
    assert!(text.contains("\"A1\" at /dev/ttyUSB0; serial number \"B2\" at /dev/ttyUSB1"), "{text}");
    assert!(text.contains("/dev/serial/by-id"), "{text}");
}
