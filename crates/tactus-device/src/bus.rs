//! The USB devices that the kernel lists in `/sys/bus/usb/devices`.
//!
//! No device is opened, so none is disturbed and no permission is needed. Of an interface with alternate settings, the
//! active one is shown.

use std::fs;
use std::path::{Path, PathBuf};

/// Folder with an entry for each device.
pub(crate) const ROOT: &str = "/sys/bus/usb/devices";

/// A USB device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct UsbDevice {
    pub(crate) bus: u8,
    /// Its address on the bus, valid until it is unplugged.
    pub(crate) address: u8,
    pub(crate) vid: u16,
    pub(crate) pid: u16,
    pub(crate) serial: Option<String>,
    pub(crate) product: Option<String>,
    /// Sorted by number.
    pub(crate) interfaces: Vec<UsbInterface>,
}

/// An interface of a USB device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct UsbInterface {
    pub(crate) number: u8,
    /// 0xFF is vendor-specific.
    pub(crate) class: u8,
    /// The driver that claims it; `usbfs` for a program.
    pub(crate) driver: Option<String>,
    /// Sorted by address.
    pub(crate) endpoints: Vec<UsbEndpoint>,
}

/// An endpoint of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UsbEndpoint {
    /// From 0x80 on, it sends to the host.
    pub(crate) address: u8,
    pub(crate) kind: EndpointKind,
    /// Greatest length of a packet in bytes.
    pub(crate) packet_bytes: u16,
}

/// Transfer type of an endpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EndpointKind {
    Bulk,
    Interrupt,
    /// Control or isochronous.
    Other,
}

impl UsbDevice {
    /// Its node in `/dev`, whose permissions decide who may open it.
    pub(crate) fn node(&self) -> PathBuf {
        format!("/dev/bus/usb/{:03}/{:03}", self.bus, self.address).into()
    }
}

impl UsbEndpoint {
    pub(crate) fn is_in(self) -> bool {
        self.address & 0x80 != 0
    }
}

/// Lists all devices; none where there is no USB. A device that is unplugged meanwhile is left out.
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
        // The higher bits count packets in a microframe, for high-speed isochronous and interrupt endpoints.
        packet_bytes: size & 0x07FF,
    })
}

fn byte(folder: &Path, name: &str) -> Option<u8> {
    u8::from_str_radix(&attribute(folder, name)?, 16).ok()
}

/// The text of an attribute; `None` if it is missing or empty.
fn attribute(folder: &Path, name: &str) -> Option<String> {
    let bytes = fs::read(folder.join(name)).ok()?;
    let text = String::from_utf8_lossy(&bytes).trim().to_owned();
    (!text.is_empty()).then_some(text)
}

/// Folders in a folder, and links to folders, sorted by name.
fn folders(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

#[cfg(test)]
#[path = "bus_tests.rs"]
pub(crate) mod tests;
