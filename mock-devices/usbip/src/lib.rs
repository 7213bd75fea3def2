//! The device's side of USB: virtual devices that a real kernel enumerates, without any hardware.
//!
//! A `Gadget` is a USB device: its descriptors, and one or more `Function`s
//! (CDC-ACM, FTDI, HID, vendor bulk), behind each of which sits a [`Device`](tactus_virtual::cable::Device) that knows
//! nothing of USB. A `Peer` answers a host controller's messages for it (USB/IP);
//! neither reads a clock nor does I/O, so that both are tested without a kernel. A [`Plug`] puts the
//! peer at the other end of a socket pair, whose first end the kernel's `vhci_hcd` takes for a network's
//! ([`Vhci`]), and pumps.
//!
//! What real devices do and simpler emulations do not: a transfer for which there is nothing waits (NAK) until
//! there is, or until the host takes it back; an endpoint can halt (STALL) until the host clears it; the cable
//! comes out and goes in again, in the same place or in another.
//!
//! Each device runs at one speed only, and so has no descriptors for another.
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
