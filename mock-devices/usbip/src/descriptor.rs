//! Descriptors: a device's description of itself for the host.
//!
//! # Source
//! USB 2.0, section 9.6: tables 9-8 (device), 9-10 (configuration), 9-12 (interface), 9-13 (endpoint), 9-15 and
//! 9-16 (strings). The association of interfaces is the engineering change notice of 2003, table 9-Z.

/// Types of descriptors, table 9-5.
pub(crate) mod kind {
    pub(crate) const DEVICE: u8 = 1;
    pub(crate) const CONFIGURATION: u8 = 2;
    pub(crate) const STRING: u8 = 3;
    pub(crate) const INTERFACE: u8 = 4;
    pub(crate) const ENDPOINT: u8 = 5;
    pub(crate) const INTERFACE_ASSOCIATION: u8 = 11;
}

/// The direction bit of an endpoint's address: to the host.
pub(crate) const IN: u8 = 0x80;

/// U.S. English, the only language of the strings.
const LANGUAGE: u16 = 0x0409;

/// USB 2.0, in binary-coded decimals.
const USB_RELEASE: u16 = 0x0200;

/// Length of the control endpoint's packets: the only one at high speed.
const CONTROL_PACKET_BYTES: u8 = 64;

/// How fast a device is; the numbers are the kernel's (`enum usb_device_speed`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Speed {
    /// 12 Mbit/s.
    Full = 2,
    /// 480 Mbit/s.
    High = 3,
}

impl Speed {
    /// The longest packet of a bulk endpoint, section 5.8.3.
    pub(crate) fn bulk_packet_bytes(self) -> u16 {
        match self {
            Self::Full => 64,
            Self::High => 512,
        }
    }
}

/// Class, subclass and protocol of a device or an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Class(pub(crate) u8, pub(crate) u8, pub(crate) u8);

impl Class {
    /// Each interface has its own class.
    pub(crate) const BY_INTERFACE: Self = Self(0, 0, 0);
    /// Interfaces are associated.
    pub(crate) const BY_ASSOCIATION: Self = Self(0xEF, 2, 1);
    /// Defined by the vendor.
    pub(crate) const VENDOR: Self = Self(0xFF, 0xFF, 0xFF);
}

/// A device as a whole. Its strings are number 1 (manufacturer), 2 (product) and 3 (serial number).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DeviceDescriptor {
    pub(crate) class: Class,
    pub(crate) vendor: u16,
    pub(crate) product: u16,
    /// Release of the device, in binary-coded decimals.
    pub(crate) release: u16,
}

impl DeviceDescriptor {
    /// Its 18 bytes, with one configuration.
    pub(crate) fn encode(&self) -> Vec<u8> {
        let Class(class, subclass, protocol) = self.class;
        let mut bytes = Vec::with_capacity(18);
        bytes.extend([18, kind::DEVICE]);
        bytes.extend(USB_RELEASE.to_le_bytes());
        bytes.extend([class, subclass, protocol, CONTROL_PACKET_BYTES]);
        for word in [self.vendor, self.product, self.release] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend([1, 2, 3, 1]);
        bytes
    }
}

/// Transfer type of an endpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TransferType {
    Bulk,
    /// Polled at least every `interval`: in ms at full speed, in units of 2^(n-1) / 8 ms at high speed.
    Interrupt {
        interval: u8,
    },
}

/// An endpoint other than the control endpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Endpoint {
    /// Its number, with [`IN`] if it sends.
    pub(crate) address: u8,
    pub(crate) carrier: TransferType,
    pub(crate) packet_bytes: u16,
}

impl Endpoint {
    fn encode(self) -> impl Iterator<Item = u8> {
        let (attributes, interval) = match self.carrier {
            TransferType::Bulk => (2, 0),
            TransferType::Interrupt { interval } => (3, interval),
        };
        let [low, high] = self.packet_bytes.to_le_bytes();
        [7, kind::ENDPOINT, self.address, attributes, low, high, interval].into_iter()
    }
}

/// An interface with a single setting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Interface {
    pub(crate) number: u8,
    pub(crate) class: Class,
    /// Complete descriptors of the class, between those of the interface and of its endpoints.
    pub(crate) class_descriptors: Vec<u8>,
    pub(crate) endpoints: Vec<Endpoint>,
}

impl Interface {
    fn encode(&self, bytes: &mut Vec<u8>) {
        let Class(class, subclass, protocol) = self.class;
        let endpoints = u8::try_from(self.endpoints.len()).unwrap_or(u8::MAX);
        bytes.extend([9, kind::INTERFACE, self.number, 0, endpoints, class, subclass, protocol, 0]);
        bytes.extend_from_slice(&self.class_descriptors);
        bytes.extend(self.endpoints.iter().flat_map(|endpoint| endpoint.encode()));
    }
}

/// The interfaces of one function: one, or several that are associated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FunctionDescriptors {
    pub(crate) interfaces: Vec<Interface>,
}

impl FunctionDescriptors {
    fn encode(&self, bytes: &mut Vec<u8>) {
        if let [first, _, ..] = &self.interfaces[..] {
            let Class(class, subclass, protocol) = first.class;
            let count = u8::try_from(self.interfaces.len()).unwrap_or(u8::MAX);
            let association = kind::INTERFACE_ASSOCIATION;
            bytes.extend([8, association, first.number, count, class, subclass, protocol, 0]);
        }
        for interface in &self.interfaces {
            interface.encode(bytes);
        }
    }
}

/// The only configuration: all interfaces, in the order of their numbers. The device takes 100 mA from the bus.
pub(crate) fn configuration(groups: &[FunctionDescriptors]) -> Vec<u8> {
    let mut body = Vec::new();
    for group in groups {
        group.encode(&mut body);
    }
    let interfaces = groups.iter().map(|group| group.interfaces.len()).sum::<usize>();
    let total = u16::try_from(9 + body.len()).unwrap_or(u16::MAX);
    let mut bytes = vec![9, kind::CONFIGURATION];
    bytes.extend(total.to_le_bytes());
    bytes.extend([u8::try_from(interfaces).unwrap_or(u8::MAX), 1, 0, 0x80, 50]);
    bytes.extend(body);
    bytes
}

/// The list of languages, which is string number 0.
pub(crate) fn languages() -> Vec<u8> {
    let [low, high] = LANGUAGE.to_le_bytes();
    vec![4, kind::STRING, low, high]
}

/// A string, cut to the length of a descriptor.
pub(crate) fn string(text: &str) -> Vec<u8> {
    /// The length is one byte, and each unit has two.
    const UNITS_MAX: usize = 126;
    let units: Vec<u16> = text.encode_utf16().take(UNITS_MAX).collect();
    let mut bytes = vec![u8::try_from(2 + 2 * units.len()).unwrap_or(u8::MAX), kind::STRING];
    bytes.extend(units.into_iter().flat_map(u16::to_le_bytes));
    bytes
}

#[cfg(test)]
#[path = "descriptor_tests.rs"]
mod tests;
