//! The USB devices that the system knows, as it shows them in `/sys/bus/usb/devices`.
//!
//! They are read there and not asked: nothing is opened, so no device is disturbed and no permission is needed.
//! Of interfaces with alternate settings the one that is set is shown.

use std::fs;
use std::path::{Path, PathBuf};

/// Where they are.
pub(crate) const ROOT: &str = "/sys/bus/usb/devices";

/// A device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct UsbDevice {
    /// Number of its bus.
    pub(crate) bus: u8,
    /// Its address there, until it is unplugged.
    pub(crate) address: u8,
    pub(crate) vid: u16,
    pub(crate) pid: u16,
    pub(crate) serial: Option<String>,
    pub(crate) product: Option<String>,
    /// By number.
    pub(crate) interfaces: Vec<UsbInterface>,
}

/// One of its interfaces.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct UsbInterface {
    pub(crate) number: u8,
    /// 0xFF is the vendor's own.
    pub(crate) class: u8,
    /// The driver that has it; `usbfs` if it is a program.
    pub(crate) driver: Option<String>,
    /// By address.
    pub(crate) endpoints: Vec<UsbEndpoint>,
}

/// An endpoint of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UsbEndpoint {
    /// From 0x80 on, it is read.
    pub(crate) address: u8,
    pub(crate) kind: EndpointKind,
    /// The most that a packet of it has.
    pub(crate) packet_bytes: u16,
}

/// How an endpoint carries data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EndpointKind {
    Bulk,
    Interrupt,
    /// Control or isochronous.
    Other,
}

impl UsbDevice {
    /// Its node, whose permissions decide who may open it.
    pub(crate) fn node(&self) -> PathBuf {
        format!("/dev/bus/usb/{:03}/{:03}", self.bus, self.address).into()
    }
}

impl UsbEndpoint {
    pub(crate) fn is_in(self) -> bool {
        self.address & 0x80 != 0
    }
}

/// All of them; none where there is no USB. What goes away while it is read is left out.
pub(crate) fn devices(root: &Path) -> Vec<UsbDevice> {
    let mut devices: Vec<_> = folders(root).iter().filter_map(|folder| device(folder)).collect();
    devices.sort_by_key(|device| (device.bus, device.address));
    devices
}

fn device(folder: &Path) -> Option<UsbDevice> {
    let mut interfaces: Vec<_> = folders(folder).iter().filter_map(|folder| interface(folder)).collect();
    interfaces.sort_by_key(|interface| interface.number);
    Some(UsbDevice {
        bus: attribute(folder, "busnum")?.parse().ok()?,
        address: attribute(folder, "devnum")?.parse().ok()?,
        vid: u16::from_str_radix(&attribute(folder, "idVendor")?, 16).ok()?,
        pid: u16::from_str_radix(&attribute(folder, "idProduct")?, 16).ok()?,
        serial: attribute(folder, "serial"),
        product: attribute(folder, "product"),
        interfaces,
    })
}

fn interface(folder: &Path) -> Option<UsbInterface> {
    let mut endpoints: Vec<_> = folders(folder).iter().filter_map(|folder| endpoint(folder)).collect();
    endpoints.sort_by_key(|endpoint| endpoint.address);
    let driver = fs::read_link(folder.join("driver")).ok();
    Some(UsbInterface {
        number: byte(folder, "bInterfaceNumber")?,
        class: byte(folder, "bInterfaceClass")?,
        driver: driver.and_then(|driver| Some(driver.file_name()?.to_string_lossy().into_owned())),
        endpoints,
    })
}

fn endpoint(folder: &Path) -> Option<UsbEndpoint> {
    let size = u16::from_str_radix(&attribute(folder, "wMaxPacketSize")?, 16).ok()?;
    Some(UsbEndpoint {
        address: byte(folder, "bEndpointAddress")?,
        kind: match attribute(folder, "type")?.as_str() {
            "Bulk" => EndpointKind::Bulk,
            "Interrupt" => EndpointKind::Interrupt,
            _ => EndpointKind::Other,
        },
        // Above are the packets a microframe of fast isochronous and interrupt endpoints.
        packet_bytes: size & 0x07FF,
    })
}

fn byte(folder: &Path, name: &str) -> Option<u8> {
    u8::from_str_radix(&attribute(folder, name)?, 16).ok()
}

/// What an attribute says, if it says anything.
fn attribute(folder: &Path, name: &str) -> Option<String> {
    let bytes = fs::read(folder.join(name)).ok()?;
    let text = String::from_utf8_lossy(&bytes).trim().to_owned();
    (!text.is_empty()).then_some(text)
}

/// Folders in a folder, by name; links to them too.
fn folders(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

#[cfg(test)]
#[path = "bus_tests.rs"]
pub(crate) mod tests;
