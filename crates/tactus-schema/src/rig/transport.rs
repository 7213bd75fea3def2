//! Transports to devices in the rig file.
//!
//! ```toml
//! transport = { kind = "serial", path = "/dev/serial/by-id/...", baud = 115200 }
//! transport = { kind = "serial", usb = { vid = 0x0403, pid = 0x6001, serial = "A1" }, baud = 115200 }
//! transport = { kind = "usb", vid = 0x1209, pid = 0x0020, serial = "A1", interface = 3, endpoint_in = 0x85, endpoint_out = 0x05 }
//! transport = { kind = "hid", vid = 0x1209, pid = 0x0020, serial = "A1", interface = 2, report_bytes = 64 }
//! transport = { kind = "tcp", address = "127.0.0.1:4001" }
//! transport = { kind = "embedded" }
//! ```
//!
//! `serial`, `endpoint_out`, `report_bytes` and the interface of a HID may be left out.

use std::fmt;
use std::str::FromStr;

use serde::Deserialize;

use crate::description::{WrongField, wrong};

/// The transport of a device's bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Transport {
    /// The rig's own virtual device, in the service's process.
    Embedded,
    /// A serial port or pseudo-terminal.
    Serial {
        /// How the port is found.
        port: SerialPort,
        /// Bits per second.
        baud: u32,
    },
    /// A USB interface without a driver of the system's own; each transfer is a packet.
    Usb(UsbLink),
    /// A device of USB's class HID (human interface device); each report is a packet.
    Hid(HidLink),
    /// A serial server.
    Tcp {
        /// `host:port`.
        address: String,
    },
}

/// Which serial port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SerialPort {
    /// The port at a path, best a stable one such as those in `/dev/serial/by-id`.
    Path(String),
    /// The port of a USB device, under whatever path.
    Usb(UsbIdentity),
}

/// Identifies a USB device at any socket.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct UsbIdentity {
    /// The vendor's USB id.
    pub vid: u16,
    /// The vendor's id of the product.
    pub pid: u16,
    /// Serial number of the device; `None` matches any.
    pub serial: Option<String>,
}

/// The endpoints of a USB interface; the device's descriptor says whether they are bulk or interrupt endpoints.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsbLink {
    /// Vendor, product and serial number of the device.
    pub identity: UsbIdentity,
    /// Number of the interface.
    pub interface: u8,
    /// Address of the endpoint that is read, 0x81 to 0x8F.
    pub endpoint_in: u8,
    /// Address of the endpoint that is written, 0x01 to 0x0F; nothing is written if `None`.
    pub endpoint_out: Option<u8>,
}

/// A human interface device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HidLink {
    /// Vendor, product and serial number of the device.
    pub identity: UsbIdentity,
    /// Number of its interface, for a device that has several.
    pub interface: Option<u8>,
    /// Length of the longest report in bytes, including its id if it has one; a longer one is refused, not cut off.
    pub report_bytes: Option<usize>,
}

/// Length of the longest report that the system's HID driver passes on, in bytes.
pub const MAX_REPORT_BYTES: usize = 16_384;

impl Transport {
    /// The value of `transport =` in a rig file.
    pub fn to_toml(&self) -> String {
        match self {
            Self::Embedded => "{ kind = \"embedded\" }".to_owned(),
            Self::Serial { port: SerialPort::Path(path), baud } => {
                format!("{{ kind = \"serial\", path = {}, baud = {baud} }}", quoted(path))
            }
            Self::Serial { port: SerialPort::Usb(identity), baud } => {
                format!("{{ kind = \"serial\", usb = {{ {} }}, baud = {baud} }}", identity.to_toml())
            }
            Self::Usb(UsbLink { identity, interface, endpoint_in, endpoint_out }) => {
                let out = endpoint_out.map(|out| format!(", endpoint_out = {out:#04x}")).unwrap_or_default();
                let keys = identity.to_toml();
                format!(
                    "{{ kind = \"usb\", {keys}, interface = {interface}, endpoint_in = {endpoint_in:#04x}{out} }}"
                )
            }
            Self::Hid(HidLink { identity, interface, report_bytes }) => {
                let interface = interface.map(|number| format!(", interface = {number}")).unwrap_or_default();
                let bytes = report_bytes.map(|bytes| format!(", report_bytes = {bytes}")).unwrap_or_default();
                format!("{{ kind = \"hid\", {}{interface}{bytes} }}", identity.to_toml())
            }
            Self::Tcp { address } => format!("{{ kind = \"tcp\", address = {} }}", quoted(address)),
        }
    }
}

impl fmt::Display for Transport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Embedded => f.write_str("embedded"),
            Self::Serial { port, .. } => port.fmt(f),
            Self::Usb(link) => link.fmt(f),
            Self::Hid(link) => link.fmt(f),
            Self::Tcp { address } => write!(f, "tcp:{address}"),
        }
    }
}

impl fmt::Display for SerialPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Path(path) => f.write_str(path),
            Self::Usb(identity) => write!(f, "serial:{identity}"),
        }
    }
}

/// `usb:1209:0020/A1`: short, for logs and errors, which name interface and endpoints where they matter.
impl fmt::Display for UsbLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "usb:{}", self.identity)
    }
}

/// `hid:1209:0020/A1`.
impl fmt::Display for HidLink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "hid:{}", self.identity)
    }
}

impl UsbIdentity {
    /// True for a device with these numbers; `serial` is its serial number, if it has one.
    pub fn is_of(&self, vid: u16, pid: u16, serial: Option<&str>) -> bool {
        (self.vid, self.pid) == (vid, pid) && (self.serial.is_none() || self.serial.as_deref() == serial)
    }

    fn to_toml(&self) -> String {
        let Self { vid, pid, serial } = self;
        let serial = serial.as_ref().map(|serial| format!(", serial = {}", quoted(serial)));
        format!("vid = {vid:#06x}, pid = {pid:#06x}{}", serial.unwrap_or_default())
    }
}

/// `1209:0020/A1`; without a serial number, `1209:0020`.
impl fmt::Display for UsbIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04x}:{:04x}", self.vid, self.pid)?;
        match &self.serial {
            Some(serial) => write!(f, "/{serial}"),
            None => Ok(()),
        }
    }
}

/// A text is not a USB identity.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is not VID:PID or VID:PID/SERIAL, such as 1209:0020/A1 with the numbers in hexadecimal")]
pub struct IdentityError {
    text: String,
}

impl FromStr for UsbIdentity {
    type Err = IdentityError;

    fn from_str(text: &str) -> Result<Self, IdentityError> {
        let number = |digits: &str| match digits.len() {
            // `from_str_radix` would accept a sign.
            1..=4 if !digits.starts_with('+') => u16::from_str_radix(digits, 16).ok(),
            _ => None,
        };
        let (numbers, serial) = match text.split_once('/') {
            Some((numbers, serial)) => (numbers, Some(serial.to_owned())),
            None => (text, None),
        };
        let numbers = numbers.split_once(':').and_then(|(vid, pid)| Some((number(vid)?, number(pid)?)));
        match numbers {
            Some((vid, pid)) if serial.as_deref() != Some("") => Ok(Self { vid, pid, serial }),
            _ => Err(IdentityError { text: text.to_owned() }),
        }
    }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Numbers have TOML's width here, so that a refusal can name the field.
#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum RawTransport {
    /// The rig's own virtual device, in the service's process.
    Embedded,
    /// A serial port or pseudo-terminal, by `path` or by `usb`.
    Serial {
        /// The port's path, best a stable one in `/dev/serial/by-id`.
        path: Option<String>,
        /// The port of this USB device, under whatever path.
        usb: Option<RawIdentity>,
        /// Bits per second.
        baud: u32,
    },
    /// A USB interface without a driver of the system's own.
    Usb {
        /// The vendor's USB id.
        vid: i64,
        /// The vendor's id of the product.
        pid: i64,
        /// Serial number of the device; without the key any.
        serial: Option<String>,
        /// Number of the interface.
        interface: i64,
        /// Address of the endpoint that is read, 0x81 to 0x8F.
        endpoint_in: i64,
        /// Address of the endpoint that is written, 0x01 to 0x0F; without the key nothing is written.
        endpoint_out: Option<i64>,
    },
    /// A human interface device.
    Hid {
        /// The vendor's USB id.
        vid: i64,
        /// The vendor's id of the product.
        pid: i64,
        /// Serial number of the device; without the key any.
        serial: Option<String>,
        /// Number of its interface, for a device that has several.
        interface: Option<i64>,
        /// Length of the longest report in bytes, with its id if it has one.
        report_bytes: Option<i64>,
    },
    /// A serial server.
    Tcp {
        /// `HOST:PORT`.
        address: String,
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawIdentity {
    /// The vendor's USB id.
    vid: i64,
    /// The vendor's id of the product.
    pid: i64,
    /// Serial number of the device; without the key any.
    serial: Option<String>,
}

impl RawTransport {
    pub(super) fn check(self, field: &str) -> Result<Transport, WrongField> {
        match self {
            Self::Embedded => Ok(Transport::Embedded),
            Self::Serial { baud: 0, .. } => Err(wrong(format!("{field}.baud"), "a baud rate above 0")),
            Self::Serial { path: Some(path), usb: None, baud } if !path.is_empty() => {
                Ok(Transport::Serial { port: SerialPort::Path(path), baud })
            }
            Self::Serial { path: Some(_), usb: None, .. } => Err(wrong(
                format!("{field}.path"),
                "empty; the port's path, such as one under /dev/serial/by-id",
            )),
            Self::Serial { path: None, usb: Some(identity), baud } => {
                let port = SerialPort::Usb(identity.check(&format!("{field}.usb"))?);
                Ok(Transport::Serial { port, baud })
            }
            Self::Serial { .. } => Err(wrong(
                field,
                "a serial transport needs one of path and usb: path = \"/dev/serial/by-id/...\", or \
                 usb = { vid = 0x0403, pid = 0x6001, serial = \"...\" }; `tactus devices` shows which",
            )),
            Self::Usb { vid, pid, serial, interface, endpoint_in, endpoint_out } => {
                Ok(Transport::Usb(UsbLink {
                    identity: RawIdentity { vid, pid, serial }.check(field)?,
                    interface: interface_number(field, interface)?,
                    endpoint_in: endpoint(field, "endpoint_in", endpoint_in, 0x81..=0x8F)?,
                    endpoint_out: endpoint_out
                        .map(|address| endpoint(field, "endpoint_out", address, 0x01..=0x0F))
                        .transpose()?,
                }))
            }
            Self::Hid { vid, pid, serial, interface, report_bytes } => Ok(Transport::Hid(HidLink {
                identity: RawIdentity { vid, pid, serial }.check(field)?,
                interface: interface.map(|number| interface_number(field, number)).transpose()?,
                report_bytes: report_bytes.map(|bytes| report_length(field, bytes)).transpose()?,
            })),
            Self::Tcp { address }
                if address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok()) =>
            {
                Ok(Transport::Tcp { address })
            }
            Self::Tcp { address } => Err(wrong(field, format!("address {address:?} is not host:port"))),
        }
    }
}

impl RawIdentity {
    fn check(self, field: &str) -> Result<UsbIdentity, WrongField> {
        let number = |name: &str, value: i64| {
            u16::try_from(value)
                .map_err(|_| wrong(format!("{field}.{name}"), format!("{value} is not in 0 to 0xFFFF")))
        };
        if self.serial.as_deref() == Some("") {
            return Err(wrong(
                format!("{field}.serial"),
                "empty; leave it out for a device without a serial number",
            ));
        }
        Ok(UsbIdentity { vid: number("vid", self.vid)?, pid: number("pid", self.pid)?, serial: self.serial })
    }
}

fn interface_number(field: &str, number: i64) -> Result<u8, WrongField> {
    u8::try_from(number)
        .map_err(|_| wrong(format!("{field}.interface"), format!("{number} is not in 0 to 255")))
}

fn endpoint(
    field: &str,
    name: &str,
    address: i64,
    addresses: std::ops::RangeInclusive<u8>,
) -> Result<u8, WrongField> {
    let address_ok = u8::try_from(address).ok().filter(|address| addresses.contains(address));
    address_ok.ok_or_else(|| {
        let (first, last) = (addresses.start(), addresses.end());
        wrong(format!("{field}.{name}"), format!("{address:#04x} is not in {first:#04x} to {last:#04x}"))
    })
}

fn report_length(field: &str, bytes: i64) -> Result<usize, WrongField> {
    usize::try_from(bytes).ok().filter(|bytes| (1..=MAX_REPORT_BYTES).contains(bytes)).ok_or_else(|| {
        wrong(format!("{field}.report_bytes"), format!("{bytes} is not in 1 to {MAX_REPORT_BYTES}"))
    })
}

#[cfg(test)]
#[path = "transport_tests.rs"]
mod tests;
