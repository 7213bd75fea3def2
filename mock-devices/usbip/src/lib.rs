//! The device side of USB: virtual devices that a real kernel enumerates, without hardware.
//!
//! A `Gadget` is a USB device: its descriptors, and one or more `Function`s (CDC-ACM, FTDI, HID, vendor bulk). Behind each
//! function is a [`Device`](tactus_virtual::cable::Device), which knows nothing of USB. A `Peer` answers a host
//! controller's USB/IP messages for the gadget. Neither reads a clock nor does I/O, so both are tested without a kernel. A
//! [`Plug`] connects the peer to one end of a socket pair; the kernel's `vhci_hcd` ([`Vhci`]) has the other end.
//!
//! Like real devices, and unlike simpler emulations: a transfer without data waits (NAK) until there are some, or until the
//! host cancels it; an endpoint can halt (STALL) until the host clears the halt; the cable can be unplugged and plugged in
//! again, at the same port or at another.
//!
//! Each device runs at one speed only, so it has no descriptors for another.
//!
//! # Source
//! The Universal Serial Bus Specification 2.0 (chapters 5, 8 and 9), the class documents named in the functions'
//! modules, and the Linux kernel's `usbip_protocol` document.

mod backing;
mod command;
mod descriptor;
mod function;
mod gadget;
mod identity;
mod message;
mod peer;
mod pipe;
mod plug;
mod setup;
mod vhci;

pub use backing::BackingDevice;
pub use command::{PlugCommand, PlugCommandError};
pub use function::FunctionKind;
pub use function::hid::REPORT_BYTES_MAX;
pub use identity::Identity;
pub use plug::{Order, Plug};
pub use vhci::{Vhci, VhciError};
