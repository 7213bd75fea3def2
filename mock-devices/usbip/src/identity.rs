//! Numbers and strings of a virtual device.

use crate::function::ftdi::Ftdi;

/// pid.codes. Its products 1 to 16 are reserved for tests.
const VENDOR: u16 = 0x1209;

const MANUFACTURER: &str = "Tactus SIM";

/// The numbers and strings of a device. The serial number says that it is simulated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// `idVendor`.
    pub vendor: u16,
    /// `idProduct`.
    pub product: u16,
    /// `bcdDevice`.
    pub release: u16,
    /// Manufacturer, product, serial number.
    pub strings: [String; 3],
}

impl Identity {
    /// A test device of pid.codes.
    pub fn own(product: u16, name: &str, serial: &str) -> Self {
        Self::new([VENDOR, product, 0x0100], name, serial)
    }

    /// An adapter with FTDI's chip.
    pub fn ftdi(name: &str, serial: &str) -> Self {
        Self::new([Ftdi::VENDOR, Ftdi::PRODUCT, Ftdi::RELEASE], name, serial)
    }

    fn new([vendor, product, release]: [u16; 3], name: &str, serial: &str) -> Self {
        let strings = [MANUFACTURER, name, serial].map(str::to_owned);
        Self { vendor, product, release, strings }
    }
}
