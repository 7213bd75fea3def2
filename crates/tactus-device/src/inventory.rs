//! Lists the connected devices that a rig could use, each with the transport to write into the rig file.
//!
//! Everything is read from the operating system's lists. No device is opened or queried, so none is disturbed.

mod holders;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rustix::fs::{Access as Mode, access};
use serialport::{SerialPortInfo, SerialPortType};
use tactus_schema::rig::{HidLink, SerialPort, Transport, UsbIdentity, UsbLink};

use crate::bus::{self, EndpointKind, UsbDevice, UsbInterface};
use crate::transport::hid::{self, HidNode};
use crate::transport::serial;
use holders::Holders;

pub use holders::Holder;

/// A connected device that a rig could use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundDevice {
    /// The transport to write into a rig file. The bit rate of a serial port is a guess.
    pub transport: Transport,
    /// True if `transport` finds this device and no other, at any socket and beside any other devices.
    pub is_stable: bool,
    /// Its vendor, product and serial number; `None` if it is not on USB.
    pub identity: Option<UsbIdentity>,
    /// Its product name, as it reports it.
    pub product: Option<String>,
    /// Its node in `/dev`; may change when it is plugged in again.
    pub node: PathBuf,
    /// Its stable name under `/dev/serial/by-id`, for serial ports.
    pub by_id: Option<PathBuf>,
    /// Whether this user may open it.
    pub access: Access,
}

/// Whether a device may be opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Access {
    /// Nothing was found that prevents it.
    Free,
    /// This user has no permission.
    Denied,
    /// Another program has it open; `None` if the system does not say which.
    Held(Option<Holder>),
}

impl FoundDevice {
    /// True if a rig with this transport uses this device.
    pub fn is_meant_by(&self, transport: &Transport) -> bool {
        let is_of = |identity: &UsbIdentity| {
            let own = self.identity.as_ref();
            own.is_some_and(|own| identity.is_of(own.vid, own.pid, own.serial.as_deref()))
        };
        match (&self.transport, transport) {
            (Transport::Serial { .. }, Transport::Serial { port, .. }) => match port {
                SerialPort::Path(path) => {
                    let place = fs::canonicalize(path);
                    place.is_ok_and(|place| fs::canonicalize(&self.node).is_ok_and(|node| node == place))
                }
                SerialPort::Usb(identity) => is_of(identity),
            },
            (Transport::Usb(own), Transport::Usb(link)) => {
                own.interface == link.interface && is_of(&link.identity)
            }
            (Transport::Hid(own), Transport::Hid(link)) => {
                (link.interface.is_none() || own.interface == link.interface) && is_of(&link.identity)
            }
            _ => false,
        }
    }
}

/// Lists serial ports, then USB interfaces, then human interface devices. Keyboards, mice and USB interfaces with a
/// kernel driver are left out.
///
/// # Errors
/// If the system refuses to list its devices. A system without devices gives an empty list.
pub fn inventory() -> io::Result<Vec<FoundDevice>> {
    let holders = Holders::read(Path::new("/proc"));
    let mut found = serial_ports(&serial::ports()?, Path::new("/dev/serial/by-id"));
    found.extend(usb_interfaces(&bus::devices(Path::new(bus::ROOT)), &holders));
    found.extend(hid_nodes(hid::nodes()?));
    // A container may show all devices of the machine in `/sys`, but the nodes of only a few.
    found.retain(|one| one.node.exists());
    for one in &mut found {
        if access(&one.node, Mode::READ_OK | Mode::WRITE_OK).is_err() {
            one.access = Access::Denied;
        } else if !matches!(one.transport, Transport::Usb(_)) {
            one.access = holders.of(&one.node).map_or(Access::Free, |holder| Access::Held(Some(holder)));
        }
    }
    Ok(found)
}

/// The rate of the supported controllers. Boards with native USB ignore it.
const BAUD: u32 = 115_200;

fn serial_ports(ports: &[SerialPortInfo], by_id: &Path) -> Vec<FoundDevice> {
    let identities: Vec<Option<UsbIdentity>> = ports.iter().map(identity).collect();
    let found = ports.iter().zip(&identities).map(|(port, identity)| {
        let node = PathBuf::from(&port.port_name);
        let by_id = link_to(&node, by_id);
        let is_one =
            |own: &UsbIdentity| identities.iter().flatten().filter(|other| *other == own).count() == 1;
        let stable = identity.as_ref().filter(|own| own.serial.is_some() && is_one(own));
        let (port_of, is_stable) = match (stable, &by_id) {
            (Some(identity), _) => (SerialPort::Usb(identity.clone()), true),
            // The link of a device without a serial number names only its kind: it leads to the one plugged in last.
            (None, Some(link)) => {
                let has_serial = identity.as_ref().is_some_and(|own| own.serial.is_some());
                (SerialPort::Path(link.display().to_string()), has_serial)
            }
            // A built-in port keeps its name.
            (None, None) => (SerialPort::Path(port.port_name.clone()), identity.is_none()),
        };
        let product = match &port.port_type {
            SerialPortType::UsbPort(usb) => usb.product.clone(),
            SerialPortType::PciPort | SerialPortType::BluetoothPort | SerialPortType::Unknown => None,
        };
        FoundDevice {
            transport: Transport::Serial { port: port_of, baud: BAUD },
            is_stable,
            identity: identity.clone(),
            product,
            node,
            by_id,
            access: Access::Free,
        }
    });
    found.collect()
}

fn identity(port: &SerialPortInfo) -> Option<UsbIdentity> {
    match &port.port_type {
        SerialPortType::UsbPort(usb) => Some(UsbIdentity {
            vid: usb.vid,
            pid: usb.pid,
            serial: usb.serial_number.clone().filter(|serial| !serial.is_empty()),
        }),
        SerialPortType::PciPort | SerialPortType::BluetoothPort | SerialPortType::Unknown => None,
    }
}

/// The first symbolic link in a folder that leads to a node.
fn link_to(node: &Path, folder: &Path) -> Option<PathBuf> {
    let node = fs::canonicalize(node).ok()?;
    let links = fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    let mut links: Vec<_> =
        links.filter(|link| fs::canonicalize(link).is_ok_and(|place| place == node)).collect();
    links.sort();
    links.into_iter().next()
}

/// One entry for each endpoint that sends data to the host.
fn usb_interfaces(devices: &[UsbDevice], holders: &Holders) -> Vec<FoundDevice> {
    let mut found = Vec::new();
    for device in devices {
        let identity = UsbIdentity { vid: device.vid, pid: device.pid, serial: device.serial.clone() };
        let twins = devices.iter().filter(|other| {
            (other.vid, other.pid, &other.serial) == (device.vid, device.pid, &device.serial)
        });
        let is_stable = device.serial.is_some() && twins.count() == 1;
        for interface in device.interfaces.iter().filter(|interface| is_vendor_specific(interface)) {
            let carries = |kind: EndpointKind| kind != EndpointKind::Other;
            for read in interface.endpoints.iter().filter(|one| one.is_in() && carries(one.kind)) {
                let write = interface.endpoints.iter().find(|one| !one.is_in() && one.kind == read.kind);
                found.push(FoundDevice {
                    transport: Transport::Usb(UsbLink {
                        identity: identity.clone(),
                        interface: interface.number,
                        endpoint_in: read.address,
                        endpoint_out: write.map(|endpoint| endpoint.address),
                    }),
                    is_stable,
                    identity: Some(identity.clone()),
                    product: device.product.clone(),
                    node: device.node(),
                    by_id: None,
                    access: match interface.driver {
                        Some(_) => Access::Held(holders.of(&device.node())),
                        None => Access::Free,
                    },
                });
            }
        }
    }
    found
}

/// True for a vendor-specific interface without a kernel driver.
fn is_vendor_specific(interface: &UsbInterface) -> bool {
    interface.class == 0xFF && matches!(interface.driver.as_deref(), None | Some("usbfs"))
}

fn hid_nodes(mut nodes: Vec<HidNode>) -> Vec<FoundDevice> {
    nodes.retain(|node| !is_human_input(node));
    let told_by = |node: &HidNode| (node.identity(), node.interface);
    let found = nodes.iter().map(|node| {
        let twins = nodes.iter().filter(|other| told_by(other) == told_by(node)).count();
        FoundDevice {
            transport: Transport::Hid(HidLink {
                identity: node.identity(),
                interface: node.interface,
                report_bytes: None,
            }),
            is_stable: node.serial.is_some() && twins == 1,
            identity: Some(node.identity()),
            product: node.product.clone(),
            node: node.path.clone(),
            by_id: None,
            access: Access::Free,
        }
    });
    found.collect()
}

/// Keyboards, mice and keypads: usages 1, 2, 6 and 7 of usage page 1 (generic desktop).
fn is_human_input(node: &HidNode) -> bool {
    node.usages.iter().any(|usage| matches!(usage, (1, 1 | 2 | 6 | 7)))
}

#[cfg(test)]
#[path = "inventory_tests.rs"]
mod tests;
