//! The devices that are there and could be a rig's, each with what to write into the rig file.
//!
//! Everything is read from what the system shows; no device is opened or asked, so none is disturbed.

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

/// A device that could be a rig's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// What to write into a rig file to reach it; the bit rate of a serial port is a guess.
    pub transport: Transport,
    /// True if that finds this device and no other, wherever it is plugged in and whatever else is.
    pub is_stable: bool,
    /// Its identity on USB.
    pub identity: Option<UsbIdentity>,
    /// What it calls itself.
    pub product: Option<String>,
    /// Its node in `/dev`, until it is plugged in again.
    pub node: PathBuf,
    /// The name under `/dev/serial/by-id` that stays with it.
    pub by_id: Option<PathBuf>,
    /// Whether this user may open it.
    pub access: Access,
}

/// Whether a device may be opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Access {
    /// Nothing seems to be in the way.
    Free,
    /// This user may not.
    Denied,
    /// Another program has it; `None` if the system does not say which.
    Held(Option<Holder>),
}

impl Found {
    /// True if a rig with this transport means this device.
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

/// All of them: serial ports, then USB interfaces, then human interface devices. Keyboards and mice are left out, as
/// are USB interfaces that a driver of the system serves.
///
/// # Errors
/// If the system does not let its devices be listed. Where it has none, the list is empty.
pub fn inventory() -> io::Result<Vec<Found>> {
    let holders = Holders::read(Path::new("/proc"));
    let mut found = serial_ports(&serial::ports()?, Path::new("/dev/serial/by-id"));
    found.extend(usb_interfaces(&bus::devices(Path::new(bus::ROOT)), &holders));
    found.extend(hid_nodes(hid::nodes()?));
    // A container may see the machine's devices in `/sys` and have the nodes of few.
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

/// The usual rate of boards that do not care for it, and of the controllers that we know.
const BAUD: u32 = 115_200;

fn serial_ports(ports: &[SerialPortInfo], by_id: &Path) -> Vec<Found> {
    let identities: Vec<Option<UsbIdentity>> = ports.iter().map(identity).collect();
    let found = ports.iter().zip(&identities).map(|(port, identity)| {
        let node = PathBuf::from(&port.port_name);
        let by_id = link_to(&node, by_id);
        let is_one =
            |own: &UsbIdentity| identities.iter().flatten().filter(|other| *other == own).count() == 1;
        let stable = identity.as_ref().filter(|own| own.serial.is_some() && is_one(own));
        let (port_of, is_stable) = match (stable, &by_id) {
            (Some(identity), _) => (SerialPort::Usb(identity.clone()), true),
            // Links of devices without a serial number are by kind, and go to whichever came last.
            (None, Some(link)) => {
                let has_serial = identity.as_ref().is_some_and(|own| own.serial.is_some());
                (SerialPort::Path(link.display().to_string()), has_serial)
            }
            // A port that is built in stays where it is.
            (None, None) => (SerialPort::Path(port.port_name.clone()), identity.is_none()),
        };
        let product = match &port.port_type {
            SerialPortType::UsbPort(usb) => usb.product.clone(),
            SerialPortType::PciPort | SerialPortType::BluetoothPort | SerialPortType::Unknown => None,
        };
        Found {
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

/// The link in a folder that leads to a node.
fn link_to(node: &Path, folder: &Path) -> Option<PathBuf> {
    let node = fs::canonicalize(node).ok()?;
    let links = fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    let mut links: Vec<_> =
        links.filter(|link| fs::canonicalize(link).is_ok_and(|place| place == node)).collect();
    links.sort();
    links.into_iter().next()
}

/// One for each endpoint that is read.
fn usb_interfaces(devices: &[UsbDevice], holders: &Holders) -> Vec<Found> {
    let mut found = Vec::new();
    for device in devices {
        let identity = UsbIdentity { vid: device.vid, pid: device.pid, serial: device.serial.clone() };
        let twins = devices.iter().filter(|other| {
            (other.vid, other.pid, &other.serial) == (device.vid, device.pid, &device.serial)
        });
        let is_stable = device.serial.is_some() && twins.count() == 1;
        for interface in device.interfaces.iter().filter(|interface| is_a_programs(interface)) {
            let carries = |kind: EndpointKind| kind != EndpointKind::Other;
            for read in interface.endpoints.iter().filter(|one| one.is_in() && carries(one.kind)) {
                let write = interface.endpoints.iter().find(|one| !one.is_in() && one.kind == read.kind);
                found.push(Found {
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

/// True for an interface of the vendor's own that no driver of the system serves.
fn is_a_programs(interface: &UsbInterface) -> bool {
    interface.class == 0xFF && matches!(interface.driver.as_deref(), None | Some("usbfs"))
}

fn hid_nodes(mut nodes: Vec<HidNode>) -> Vec<Found> {
    nodes.retain(|node| !is_for_people(node));
    let told_by = |node: &HidNode| (node.identity(), node.interface);
    let found = nodes.iter().map(|node| {
        let twins = nodes.iter().filter(|other| told_by(other) == told_by(node)).count();
        Found {
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

/// Keyboards, mice and keypads: of the page of the desktop, usages 1, 2, 6 and 7.
fn is_for_people(node: &HidNode) -> bool {
    node.usages.iter().any(|usage| matches!(usage, (1, 1 | 2 | 6 | 7)))
}

#[cfg(test)]
#[path = "inventory_tests.rs"]
mod tests;
